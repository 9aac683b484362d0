//! Tasks of an array that run again, by the program: what is there is gone on from, or refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("shards-{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn luxel(folder: &Path, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(folder)
        .args(args.split(' '))
        .output()
        .unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_shard_that_is_there_is_not_rendered_again() {
    let folder = folder("there");
    let task = "render --resolution 24x16 --spp 6 --progress never --resume --shard";
    let first = luxel(&folder, &format!("{task} 1/2 -o 1.exr"));
    assert!(first.status.success(), "{}", said(&first));
    assert!(said(&first).contains("there is no 1.checkpoint.exr: rendering from the start"));
    let again = luxel(&folder, &format!("{task} 1/2 -o 1.exr"));
    assert!(again.status.success(), "{}", said(&again));
    assert!(
        said(&again).contains("1.exr is complete: nothing is left to render"),
        "{}",
        said(&again)
    );

    // As if killed in the middle of writing, and as if the shard were not yet written when that happened.
    luxel(&folder, &format!("{task} 2/2 -o 2.exr"));
    let forgotten = folder.join(".luxel-1-0.tmp");
    fs::write(&forgotten, "half of a shard").unwrap();
    let file = fs::File::options().write(true).open(&forgotten).unwrap();
    file.set_modified(SystemTime::now() - Duration::from_secs(3600))
        .unwrap();
    fs::rename(folder.join("2.exr"), folder.join("2.checkpoint.exr")).unwrap();
    let from = luxel(&folder, &format!("{task} 2/2 -o 2.exr"));
    assert!(
        said(&from).contains("2.checkpoint.exr is complete"),
        "{}",
        said(&from)
    );
    let mut files: Vec<_> = (fs::read_dir(&folder).unwrap())
        .map(|e| e.unwrap().file_name())
        .collect();
    files.sort();
    assert_eq!(files, ["1.exr", "2.exr"]);

    let merged = luxel(&folder, "merge 1.exr 2.exr -o merged.pfm");
    assert!(merged.status.success(), "{}", said(&merged));
    luxel(
        &folder,
        "render --resolution 24x16 --spp 6 --progress never -o whole.pfm",
    );
    let [merged, whole] = ["merged.pfm", "whole.pfm"].map(|f| fs::read(folder.join(f)).unwrap());
    assert!(merged == whole);
}

#[test]
fn shards_of_other_pictures_are_left_as_they_are() {
    let folder = folder("other");
    let task = "render --resolution 24x16 --progress never --resume -o 1.exr";
    let first = luxel(&folder, &format!("{task} --spp 6 --shard 1/2"));
    assert!(first.status.success(), "{}", said(&first));
    let written = fs::read(folder.join("1.exr")).unwrap();
    for (other, what) in [
        (
            "--spp 8 --shard 1/2",
            "end: 6 samples per pixel there, 8 samples per pixel here",
        ),
        ("--spp 6 --shard 2/2", "it is shard 1/2"),
        ("--spp 6 --shard 1/3", "it is shard 1/2"),
        ("--spp 6", "it is shard 1/2"),
        (
            "--spp 6 --shard 1/2 --integrator bdpt",
            "integrator: path there, bdpt here",
        ),
        (
            "--spp 6 --shard 1/2 --max-depth 3",
            "the settings of the integrator are others",
        ),
    ] {
        let refused = luxel(&folder, &format!("{task} {other}"));
        assert_eq!(refused.status.code(), Some(1), "{other}");
        let expected = format!(
            "cannot go on from 1.exr: {what}; render with what it was made with, or remove it to begin anew"
        );
        assert!(said(&refused).contains(&expected), "{}", said(&refused));
        assert!(written == fs::read(folder.join("1.exr")).unwrap());
    }
    let over = luxel(&folder, "merge 1.exr -o 1.exr");
    assert_eq!(over.status.code(), Some(2));
    assert!(
        said(&over).contains("would replace one of the shards"),
        "{}",
        said(&over)
    );
    assert!(written == fs::read(folder.join("1.exr")).unwrap());
    // Whoever does not ask to go on renders anew.
    let anew = luxel(
        &folder,
        "render --resolution 24x16 --progress never -o 1.exr --spp 8 --shard 1/2",
    );
    assert!(anew.status.success(), "{}", said(&anew));
}
