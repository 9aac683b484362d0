//! `luxel radiosity` as its users meet it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own, with a scene: a lamp over a floor, and a wall.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("radiosity_cli_{name}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("room.xml"), ROOM).unwrap();
    folder
}

const ROOM: &str = r#"<scene version="3.0.0">
    <default name="bsdf" value="diffuse"/>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
    </sensor>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/></transform>
        <bsdf type="$bsdf"/></shape>
    <shape type="rectangle"><transform name="to_world"><translate y="1" z="-1"/></transform>
        <bsdf type="$bsdf"><!-- red --></bsdf></shape>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><scale value="0.3"/><translate y="1.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="5, 4, 3"/></emitter></shape>
</scene>"#;

fn luxel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn writes_meshes_and_statistics_and_says_what_was_solved() {
    let folder = folder("meshes");
    for (solver, more) in [
        (
            "gauss-seidel",
            ["--form-factors", "analytic", "--samples", "4"].as_slice(),
        ),
        ("hierarchical", ["--error", "1e-3"].as_slice()),
    ] {
        let mut args = vec![
            "radiosity",
            "room.xml",
            "-o",
            "a.glb",
            "-o",
            "a.ply",
            "-o",
            "a.obj",
        ];
        args.extend([
            "--solver",
            solver,
            "--patch-size",
            "0.5",
            "--stats",
            "s.json",
        ]);
        args.extend(more);
        let output = luxel(&folder, &args);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let said = text(&output.stdout);
        for word in [
            "patches", solver, "residual", "absorbed", "escaped", "seconds",
        ] {
            assert!(said.contains(word), "{word}: {said}");
        }
        let glb = gltf::Gltf::open(folder.join("a.glb")).unwrap();
        assert_eq!(glb.meshes().count(), 1);
        assert!(fs::read(folder.join("a.ply")).unwrap().starts_with(b"ply"));
        let stats: serde_json::Value =
            serde_json::from_slice(&fs::read(folder.join("s.json")).unwrap()).unwrap();
        assert_eq!(stats["solver"], solver);
        assert_eq!(stats["converged"], true);
        let rows = &stats["closure"]["row_sum"];
        assert_eq!(rows.is_array(), solver == "gauss-seidel");
        assert_eq!(said.contains("reciprocity"), rows.is_array());
        // Lamp of radiance 5, 4, 3 and area 0.36: π L A.
        let emitted = stats["watts"]["emitted"][0].as_f64().unwrap();
        assert!(
            (emitted / (5.0 * 0.36 * std::f64::consts::PI) - 1.0).abs() < 1e-5,
            "{emitted}"
        );
        let sum = |key: &str| {
            let watts = stats["watts"][key].as_array().unwrap().iter();
            watts.map(|w| w.as_f64().unwrap()).sum::<f64>()
        };
        let missing = 1.0 - (sum("absorbed") + sum("escaped")) / sum("emitted");
        assert!(missing.abs() < 0.05, "{missing}");
        assert!(sum("absorbed") > 0.1 * sum("emitted"));
    }
}

#[test]
fn writes_a_mesh_to_the_current_folder_if_nothing_is_said() {
    let folder = folder("default");
    let output = luxel(&folder, &["radiosity", "room.xml", "--error", "1e-2"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(folder.join("room.glb").exists());
}

#[test]
fn the_result_is_told_without_progress() {
    let folder = folder("quiet");
    let output = luxel(
        &folder,
        &[
            "radiosity",
            "room.xml",
            "--error",
            "1e-2",
            "--walks",
            "0",
            "--exposure",
            "0.05",
            "--progress",
            "never",
        ],
    );
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("residual"));
    assert_eq!(text(&output.stderr), "wrote room.glb\n");
}

#[test]
fn pictures_of_steps_become_the_picture_of_the_result() {
    let folder = folder("snapshots");
    let mean = |name: &str| {
        let image = luxel::image_io::Image::read(folder.join(name)).unwrap();
        let pixels = image.rgb().unwrap();
        pixels.iter().map(|p| f64::from(p.g)).sum::<f64>() / pixels.len() as f64
    };
    let render = |more: &[&str]| {
        let mut args = vec!["radiosity", "room.xml", "--solver", "shooting"];
        args.extend([
            "--patch-size",
            "0.5",
            "--samples",
            "4",
            "--residual",
            "1e-3",
        ]);
        args.extend(["--snapshots", "pictures", "--snapshot-steps", "1,4,8"]);
        args.extend(more);
        let output = luxel(&folder, &args);
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    render(&["--no-ambient"]);
    let steps: Vec<f64> = ["step-000001", "step-000004", "step-000008", "result"]
        .iter()
        .map(|name| mean(&format!("pictures/{name}.exr")))
        .collect();
    assert!(steps.is_sorted() && steps[0] < 0.95 * steps[3], "{steps:?}");
    assert!(folder.join("pictures/result.png").exists());
    // With a guess at the light on its way, which is no part of the result.
    render(&["--show", "flat"]);
    let first = mean("pictures/step-000001.exr");
    let result = mean("pictures/result.exr");
    assert!(first > 1.5 * steps[0], "{first} {steps:?}");
    assert!((result / steps[3] - 1.0).abs() < 0.2, "{result} {steps:?}");
}

#[test]
fn tells_what_is_wrong_and_with_what() {
    let folder = folder("errors");
    let cases: [(&[&str], i32, &str); 14] = [
        (
            &["-o", "a.stl"],
            2,
            "-o a.stl: the extension is not .glb, .obj or .ply",
        ),
        (
            &["--solver", "magic"],
            2,
            "expected one of gauss, gauss-seidel, jacobi, shooting, hierarchical",
        ),
        (
            &["--samples", "8"],
            2,
            "--samples has no effect with the solver hierarchical",
        ),
        (
            &["--solver", "gauss", "--error", "1e-3"],
            2,
            "--error has no effect with the solver gauss",
        ),
        (
            &[
                "--solver",
                "gauss",
                "--form-factors",
                "hemicube",
                "--samples",
                "8",
            ],
            2,
            "--samples has no effect with form factors by hemicube",
        ),
        (&["--patch-size", "0"], 2, "expected a number above zero"),
        (&["--patch-size", "-1"], 2, "expected a number above zero"),
        (
            &["--walks", "-5"],
            2,
            "expected a whole number from 0 to 67108864",
        ),
        (
            &["--max-steps", "-1"],
            2,
            "expected a whole number of at least 1",
        ),
        (&["--error", "--walks", "0"], 2, "a value is required"),
        (&["--no-ambient"], 2, "--snapshots"),
        (&["-o", "none/a.glb"], 3, "cannot write none/a.glb"),
        (&["-D", "bsdf=conductor", "-D", "x=1"], 1, "x"),
        (&["--solver", "gauss", "--patch-size", "1e-3"], 1, "patches"),
    ];
    for (args, code, expected) in cases {
        let mut all = vec!["radiosity", "room.xml"];
        all.extend(args);
        let output = luxel(&folder, &all);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(expected), "{args:?}: {said}");
        assert!(!folder.join("room.glb").exists());
    }
}
