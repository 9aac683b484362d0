//! The program as its users meet it: files, exit codes, messages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// A folder of its own that goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("luxel-cli-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).unwrap();
        path
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn luxel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const SMALL: &str = r#"<scene version="3.0.0">
    <default name="albedo" value="0.5"/>
    <sensor type="perspective">
        <film type="hdrfilm"><integer name="width" value="20"/><integer name="height" value="10"/></film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    </sensor>
    <integrator type="path"/>
    <shape type="sphere"><point name="center" x="0" y="0" z="5"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="$albedo"/></bsdf></shape>
    <emitter type="constant"/>
</scene>"#;

#[test]
fn renders_the_built_in_scene_to_exr_and_png() {
    let folder = Folder::new("built-in");
    let output = luxel(
        &folder.0,
        &["render", "--resolution", "32x32", "--spp", "16"],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(folder.files(), ["cornell-balls.exr", "cornell-balls.png"]);
    let said = stderr(&output);
    assert!(
        said.contains("16 samples per pixel") && said.contains("estimated relMSE"),
        "{said}"
    );
}

#[test]
fn writes_what_was_asked_for_and_statistics() {
    let folder = Folder::new("outputs");
    folder.write("small.xml", SMALL);
    let args = [
        "render",
        "small.xml",
        "-o",
        "a.exr",
        "-o",
        "a.png",
        "-o",
        "a.jpg",
        "-o",
        "a.hdr",
        "-o",
        "a.pfm",
        "--stats",
        "s.json",
        "--seed",
        "3",
        "--threads",
        "1",
        "-D",
        "albedo=0.25",
        "--progress",
        "never",
        "--aov",
        "albedo,normal,depth",
    ];
    let output = luxel(&folder.0, &args);
    assert!(output.status.success(), "{}", stderr(&output));
    // No progress, but what came of it.
    let said = stderr(&output);
    assert!(
        said.lines().count() == 1 && said.contains("wrote a.exr, "),
        "{said}"
    );
    assert_eq!(
        folder.files(),
        [
            "a.exr",
            "a.hdr",
            "a.jpg",
            "a.pfm",
            "a.png",
            "s.json",
            "small.xml"
        ]
    );
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.0.join("s.json")).unwrap()).unwrap();
    for key in [
        "version",
        "scene",
        "integrator",
        "resolution",
        "spp",
        "seed",
        "threads",
        "seconds",
        "rays",
        "rays_per_second",
        "peak_memory_bytes",
        "estimated_error",
        "techniques",
        "plan",
    ] {
        assert!(stats.get(key).is_some(), "{key} is missing");
    }
    assert_eq!(stats["spp"], 4);
    assert_eq!(stats["threads"], 1);
    let image = luxel::image_io::Image::read(folder.0.join("a.exr")).unwrap();
    for layer in ["", "stderr", "spp", "albedo", "normal", "depth"] {
        assert!(image.layer(layer).is_some(), "layer \"{layer}\" is missing");
    }
    // The ball fills the middle of the picture: its albedo, its distance, its normal towards the camera.
    let middle = 5 * 20 + 10;
    assert!((image.channel("albedo.R").unwrap().get(middle) - 0.25).abs() < 1e-3);
    assert!((image.channel("depth.Y").unwrap().get(middle) - 4.0).abs() < 0.1);
    assert!(image.channel("normal.Z").unwrap().get(middle) < -0.9);
    let metadata: serde_json::Value = serde_json::from_str(&image.metadata.unwrap()).unwrap();
    assert_eq!(metadata["biased"], "no");
    assert_eq!(metadata["seed"], 3);
}

#[test]
fn files_are_identical_for_any_thread_count() {
    let folder = Folder::new("threads");
    folder.write("small.xml", SMALL);
    let file = |threads: &str| {
        let output = luxel(
            &folder.0,
            &[
                "render",
                "small.xml",
                "-o",
                "x.pfm",
                "--threads",
                threads,
                "--spp",
                "64",
            ],
        );
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(folder.0.join("x.pfm")).unwrap()
    };
    assert!(file("1") == file("2"));
}

#[test]
fn a_wrong_command_line_exits_with_2() {
    let folder = Folder::new("usage");
    folder.write("small.xml", SMALL);
    for args in [
        &["render", "small.xml", "--spp", "0"][..],
        &["render", "small.xml", "--spp", "-1"],
        &["render", "small.xml", "--spp", "4", "--time", "1s"],
        &["render", "small.xml", "--resolution", "20"],
        &["render", "small.xml", "--time", "5 parsecs"],
        &["render", "small.xml", "--no-such-option"],
        &["paint"],
    ] {
        let output = luxel(&folder.0, args);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{args:?}: {}",
            stderr(&output)
        );
    }
    assert_eq!(folder.files(), ["small.xml"]);
}

#[test]
fn a_wrong_scene_exits_with_1_and_writes_nothing() {
    let folder = Folder::new("scene");
    folder.write("bad.xml", &SMALL.replace("reflectance", "refletance"));
    for args in [
        &["render", "bad.xml"][..],
        &["render", "missing.xml"],
        &["render", "--crop", "500,500,20,20", "--spp", "1"],
        &["render", "--integrator", "pahth", "--spp", "1"],
        &["render", "--aov", "albdo", "--spp", "1"],
        &["render", "--resolution", "0x10"],
        &["render", "--resolution", "1000000x1000000"],
        &["render", "-D", "sp=4"],
        &["info", "bad.xml"],
    ] {
        let output = luxel(&folder.0, args);
        assert_eq!(
            output.status.code(),
            Some(1),
            "{args:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).starts_with("error: "),
            "{}",
            stderr(&output)
        );
    }
    assert_eq!(folder.files(), ["bad.xml"]);
}

/// What a scene may ask for that cannot be: each ends in one clear error, never in a file or a panic.
#[test]
fn impossible_scenes_exit_with_1_and_write_nothing() {
    let folder = Folder::new("impossible");
    folder.write("empty.obj", "# nothing\n");
    folder.write(
        "loop.xml",
        r#"<scene version="3.0.0"><include filename="loop.xml"/></scene>"#,
    );
    let with = |body: &str| SMALL.replace("<emitter", &format!("{body}<emitter"));
    let cases = [
        (
            SMALL.replace(r#"value="20""#, r#"value="1000000""#),
            "\"width\" must be an integer from 1 to 65536, not 1000000",
        ),
        (
            SMALL
                .replace(r#"value="20""#, r#"value="60000""#)
                .replace(r#"value="10""#, r#"value="60000""#),
            "3600000000 pixels are more than a picture can have (268435456)",
        ),
        (
            SMALL.replace(r#"value="4""#, r#"value="0""#),
            "\"sample_count\" must be an integer of at least 1, not 0",
        ),
        (
            SMALL.replace(
                "<film",
                r#"<transform name="to_world"><scale x="0"/></transform><film"#,
            ),
            "scaling by (0, 1, 1) cannot be undone",
        ),
        (
            with(r#"<shape type="obj"><string name="filename" value="empty.obj"/></shape>"#),
            "the mesh has no triangles",
        ),
        (
            with(r#"<include filename="loop.xml"/>"#),
            "too many includes, at \"loop.xml\"",
        ),
        (
            with(r#"<emitter type="envmap"><string name="filename" value="empty.obj"/></emitter>"#),
            "cannot read",
        ),
        (
            r#"<scene version="3.0.0"/>"#.to_string(),
            "the scene has no sensor",
        ),
        ("<scene".to_string(), ""),
        (String::new(), ""),
    ];
    for (xml, expected) in cases {
        folder.write("bad.xml", &xml);
        let output = luxel(&folder.0, &["render", "bad.xml"]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.starts_with("error: "), "{said}");
        assert_eq!(said.matches("error: ").count(), 1, "{said}");
        assert!(said.contains(expected), "{said}");
    }
    assert_eq!(folder.files(), ["bad.xml", "empty.obj", "loop.xml"]);
}

#[test]
fn an_unwritable_output_exits_with_3_before_rendering() {
    let folder = Folder::new("unwritable");
    // An unknown extension is a mistake on the command line.
    for (target, code) in [("no/such/folder/x.exr", 3), ("x.gif", 2)] {
        // The time limit would be noticed: nothing may be rendered first.
        let output = luxel(&folder.0, &["render", "-o", target, "--time", "1h"]);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{target}: {}",
            stderr(&output)
        );
    }
    assert!(folder.files().is_empty());
}

#[test]
fn a_scene_without_light_is_black_with_a_warning() {
    let folder = Folder::new("dark");
    folder.write(
        "dark.xml",
        &SMALL.replace(r#"<emitter type="constant"/>"#, ""),
    );
    let output = luxel(&folder.0, &["render", "dark.xml", "-o", "dark.pfm"]);
    assert!(output.status.success());
    assert!(
        stderr(&output).contains("warning: the scene has no emitter"),
        "{}",
        stderr(&output)
    );
    let image = luxel::image_io::Image::read(folder.0.join("dark.pfm")).unwrap();
    assert!(image.rgb().unwrap().iter().all(|c| c.is_black()));
}

#[test]
fn info_tells_what_is_there_and_what_is_supported() {
    let folder = Folder::new("info");
    folder.write("small.xml", SMALL);
    let output = luxel(&folder.0, &["info", "small.xml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains("20 x 10 pixels") && text.contains("because"),
        "{text}"
    );
    let output = luxel(&folder.0, &["info", "--json", "small.xml"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["film"]["width"], 20);
    let output = luxel(&folder.0, &["info", "--plugins"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for plugin in ["roughconductor", "envmap", "hdrfilm", "checkerboard"] {
        assert!(text.contains(plugin), "{plugin} is missing");
    }
}

#[test]
fn completions_and_help_print() {
    let folder = Folder::new("help");
    for args in [
        &["--help"][..],
        &["render", "--help"],
        &["completions", "bash"],
        &["--version"],
    ] {
        let output = luxel(&folder.0, args);
        assert!(
            output.status.success() && !output.stdout.is_empty(),
            "{args:?}"
        );
    }
}

#[cfg(unix)]
#[test]
fn interrupt_writes_what_is_done() {
    let folder = Folder::new("interrupt");
    let args = [
        "render",
        "--resolution",
        "64x64",
        "--time",
        "10m",
        "-o",
        "x.exr",
        "--progress",
        "never",
    ];
    let child = Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(&folder.0)
        .args(args)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(luxel::image_io::Image::read(folder.0.join("x.exr")).is_ok());
}
