//! Studies from the command line to the report: figures that are known, resuming, messages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A folder of its own that goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("luxel-study-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// `luxel study` with the words of `line`.
    fn study(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_luxel"))
            .current_dir(&self.0)
            .arg("study")
            .args(line.split_whitespace())
            .output()
            .unwrap()
    }

    fn done(&self, line: &str) -> String {
        let output = self.study(line);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{err}");
        err
    }

    fn refused(&self, line: &str, code: i32) -> String {
        let output = self.study(line);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{err}");
        err
    }

    /// Names and contents of the runs' files.
    fn runs(&self, study: &str) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.0.join(study).join("runs")).unwrap();
        let mut all: Vec<_> = entries
            .map(|e| {
                let e = e.unwrap();
                let name = e.file_name().to_string_lossy().into_owned();
                (name, fs::read(e.path()).unwrap())
            })
            .collect();
        all.sort();
        all
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A ball over a floor below a lamp; `albedo` is the floor's.
const BALL: &str = r#"<scene version="3.0.0">
    <default name="albedo" value="0.5"/>
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, -4, 2" target="0, 0, 0.4" up="0, 0, 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/><rfilter type="box"/></film>
        <sampler type="independent"/>
    </sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="5"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="$albedo"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="0" y="0" z="0.5"/><float name="radius" value="0.5"/>
        <bsdf type="diffuse"/></shape>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="180"/><translate x="-0.5" z="2.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="4"/></emitter></shape>
</scene>"#;

/// Nothing but an even sky.
const SKY: &str = r#"<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective">
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/><rfilter type="box"/></film>
        <sampler type="independent"/>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="0.3, 0.7, 1.1"/></emitter>
</scene>"#;

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or(f64::NAN)
}

#[test]
fn a_constant_picture_has_no_error_and_no_slope() {
    let folder = Folder::new("sky");
    folder.write("sky.xml", SKY);
    folder.done("sky.xml -o out --spp 1..8 --runs 3");
    let json = folder.json("out/results.json");
    for point in json["points"].as_array().unwrap() {
        for figure in [
            "error",
            "bias",
            "noise",
            "rmse",
            "relmse",
            "flip",
            "brightness",
        ] {
            assert_eq!(point[figure]["value"], 0.0, "{figure}");
            assert_eq!(
                point[figure]["ci95"],
                serde_json::json!([0.0, 0.0]),
                "{figure}"
            );
        }
        assert!(point["efficiency"].is_null());
    }
    let method = &json["methods"][0];
    assert!(method["error_slope"].is_null() && method["exact"] == true);
    assert_eq!(method["forecasts"][0]["kind"], "exact");
    for file in ["results.csv", "results.json", "report.html"] {
        let text = folder.read(&format!("out/{file}"));
        assert!(
            !text.contains(":NaN") && !text.contains(",NaN") && !text.contains(":null,null"),
            "{file}"
        );
    }
}

#[test]
fn noise_falls_by_the_root_and_a_wrong_scale_is_bias() {
    let folder = Folder::new("ball");
    folder.write("ball.xml", BALL);
    folder.done("ball.xml -o out --spp 1..32 --runs 6 --want 1%,100%");
    let json = folder.json("out/results.json");
    // Its own error ten times below, by its own account.
    assert_eq!(json["reference"]["ten_times_below"], true);
    assert!(number(&json["reference"]["times_below"]) >= 10.0);
    let floor = number(&json["reference"]["flip_floor"]);
    for point in json["points"].as_array().unwrap() {
        let resolved = number(&point["flip"]["value"]) >= 3.0 * floor;
        assert_eq!(point["flip_resolved"], resolved, "{point}");
    }
    let method = &json["methods"][0];
    let slope = &method["error_slope"];
    assert!(
        number(&slope["ci95"][0]) <= -0.5 && number(&slope["ci95"][1]) >= -0.5,
        "{slope}"
    );
    assert!(
        number(&slope["ci95"][1]) - number(&slope["ci95"][0]) < 0.2,
        "{slope}"
    );
    // The forecast is where the line has the wanted error: of relMSE c / N, N = c / 0.01².
    let last = &json["points"][5];
    let c = number(&last["relmse"]["value"]) * 32.0;
    let spp = number(&method["forecasts"][0]["spp"]["value"]);
    assert!((0.5..2.0).contains(&(spp * 1e-4 / c)), "{spp} {c}");
    let bias = &method["bias"];
    assert_eq!(bias["kind"], "not seen", "{bias}");

    // Judged by a reference of a floor that is darker by a tenth, all is too bright: of the picture with albedo
    // 0.5 the floor's light is proportional to it, and what the ball sends is little.
    let reference = json["reference"]["file"].as_str().unwrap().to_string();
    folder.done("ball.xml -o dark --spp 4,16 --runs 6 -D albedo=0.45");
    folder.done(&format!(
        "ball.xml -o wrong --spp 4,16 --runs 6 -D albedo=0.45 --reference out/{reference}"
    ));
    let json = folder.json("wrong/results.json");
    let (small, large) = (&json["points"][0], &json["points"][1]);
    let brightness = number(&large["brightness"]["value"]);
    assert!((-0.11..-0.05).contains(&brightness), "{brightness}");
    assert!(
        number(&large["bias"]["ci95"][0]) > 0.02,
        "{}",
        large["bias"]
    );
    // The same bias with any number of samples, and noise by the root of it.
    assert!(number(&small["bias"]["ci95"][0]) <= number(&large["bias"]["ci95"][1]));
    assert_eq!(json["methods"][0]["bias"]["kind"], "stays");
    let bias = number(&json["methods"][0]["bias"]["last"]["value"]);
    let forecast = &json["methods"][0]["forecasts"][0];
    assert_eq!(forecast["kind"], "never");
    assert_eq!(number(&forecast["bias"]), bias);
    let ratio = number(&small["noise"]["value"]) / number(&large["noise"]["value"]);
    assert!((1.7..2.3).contains(&ratio), "{ratio}");
    // error² = bias² + noise².
    let square = |f: &str| number(&large[f]["value"]).powi(2);
    assert!((square("error") / (square("bias") + square("noise")) - 1.0).abs() < 1e-6);
}

#[test]
fn studies_go_on_and_use_what_is_there() {
    let folder = Folder::new("resume");
    folder.write("ball.xml", BALL);
    folder.done("ball.xml -o out --integrators path --spp 1..4 --runs 3 --reference-time 1s");
    let first = folder.runs("out");
    assert_eq!(first.len(), 9);
    let said =
        folder.done("ball.xml -o out --integrators path --spp 1..4 --runs 3 --reference-time 1s");
    assert!(said.contains("3 runs were there"), "{said}");
    assert_eq!(folder.runs("out"), first);
    // What is damaged or missing is rendered anew, to the same picture; another integrator adds to it.
    fs::write(folder.0.join("out/runs").join(&first[0].0), b"broken").unwrap();
    fs::remove_file(folder.0.join("out/runs").join(&first[4].0)).unwrap();
    folder
        .done("ball.xml -o out --integrators path,direct --spp 1..4 --runs 4 --reference-time 1s");
    let all = folder.runs("out");
    assert_eq!(all.len(), 24);
    let same =
        |(name, bytes): &&(String, Vec<u8>)| all.iter().any(|(n, b)| n == name && b == bytes);
    assert_eq!(first.iter().filter(same).count(), 7);
    let json = folder.json("out/results.json");
    assert_eq!(json["points"].as_array().unwrap().len(), 6);
    // Pictures are pure functions of scene, seed and amount: run 1 of path is the one that `luxel render` makes.
    let point = &json["points"][0];
    let command = point["command"].as_str().unwrap();
    let words: Vec<&str> = command.split_whitespace().skip(1).collect();
    let output = Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(&folder.0)
        .args(words)
        .args(["-o", "one.exr"])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let kept = folder
        .0
        .join("out")
        .join(point["runs"][0]["file"].as_str().unwrap());
    let image = |path: &Path| luxel::image_io::Image::read(path).unwrap().rgb().unwrap();
    // Pictures of the command line may be kept in 16 bits, by the film's component format.
    for (a, b) in image(&folder.0.join("one.exr")).iter().zip(image(&kept)) {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() <= 1e-3 * b[c].abs() + 1e-6);
        }
    }
}

#[test]
fn a_reference_that_is_not_good_enough_is_said_to_be_so() {
    let folder = Folder::new("short");
    folder.write("ball.xml", BALL);
    let said = folder.done("ball.xml -o out --spp 16,64 --runs 3 --reference-time 1ms");
    let reference = &folder.json("out/results.json")["reference"];
    assert_eq!(reference["ten_times_below"], false);
    let times = number(&reference["times_below"]);
    let words = match times > 1.0 {
        true => format!("{times:.1} times below the smallest one studied, not 10"),
        false => "is not below the smallest one studied".to_string(),
    };
    assert!(said.contains(&words), "{times}: {said}");
    assert!(said.contains("--reference-time"), "{said}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_study_says_what_it_kept_and_goes_on() {
    let folder = Folder::new("interrupt");
    folder.write("ball.xml", BALL);
    // Its first runs take no time, its last ones minutes.
    let line = "ball.xml -o out --spp 1,10000000 --runs 3 --reference-time 1s";
    let child = Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(&folder.0)
        .arg("study")
        .args(line.split_whitespace())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let is_run = |e: &fs::DirEntry| e.path().extension().is_some_and(|e| e == "exr");
    let finished = || {
        fs::read_dir(folder.0.join("out/runs")).map_or(0, |d| d.flatten().filter(is_run).count())
    };
    for _ in 0..300 {
        if finished() >= 3 {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(
        said.contains("stopped: 3 finished runs and what is done of the reference are kept in out"),
        "{said}"
    );
    let said = folder.done("ball.xml -o out --spp 1 --runs 3 --reference-time 1s");
    assert!(said.contains("3 runs were there"), "{said}");
}

#[test]
fn what_is_wrong_is_said() {
    let folder = Folder::new("errors");
    folder.write("ball.xml", BALL);
    folder.write("sky.xml", SKY);
    fs::create_dir(folder.0.join("full")).unwrap();
    folder.write("full/precious.txt", "mine");
    let said = folder.refused("ball.xml -o full --spp 1", 1);
    assert!(said.contains("not empty and holds no study"), "{said}");
    folder.done("sky.xml -o out --spp 1 --runs 3");
    let said = folder.refused("ball.xml -o out --spp 1 --runs 3", 1);
    assert!(
        said.contains("a study of something else (scene is sky there and ball here"),
        "{said}"
    );
    let said = folder.refused("sky.xml -o out --spp 1 --runs 3 --resolution 4x4", 1);
    assert!(said.contains("size is 8x6 there and 4x4 here"), "{said}");
    let said = folder.refused("ball.xml -o b --spp 1 --vary albedu=1,2", 1);
    assert!(said.contains("albedu"), "{said}");
    let said = folder.refused("ball.xml -o b --spp 1 --integrators path,path", 2);
    assert!(said.contains("path is studied twice"), "{said}");
    let said = folder.refused("ball.xml -o b --spp 1 --integrators pfad", 1);
    assert!(said.contains("unknown integrator \"pfad\""), "{said}");
    let said = folder.refused("ball.xml -o b --spp 1 --reference sky.xml", 1);
    assert!(said.contains("sky.xml"), "{said}");
    let said = folder.refused(
        "ball.xml -o b --spp 1 --reference out/images/reference.png",
        1,
    );
    assert!(
        said.contains("8 x 6 pixels, but the study renders 16 x 12"),
        "{said}"
    );
    // None of these has made the folder its own.
    assert!(!folder.0.join("b").exists());
    folder.refused("ball.xml -o b --spp 8..1", 2);
    folder.refused("ball.xml -o b --runs 2", 2);
    folder.refused("ball.xml", 2);
    let said = folder.refused("ball.xml -o b --want 1e300%", 2);
    assert!(said.contains("from 0.0000001% to 1000000%"), "{said}");
}

#[test]
fn methods_that_do_not_show_the_same_thing_are_named() {
    let folder = Folder::new("differ");
    let scene = BALL.replace(
        "\"max_depth\" value=\"3\"",
        "\"max_depth\" value=\"$depth\"",
    );
    let named = "<default name=\"depth\" value=\"3\"/><default name=\"albedo\"";
    folder.write(
        "my ball.xml",
        &scene.replace("<default name=\"albedo\"", named),
    );
    let output = Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(&folder.0)
        .args(["study", "my ball.xml", "-o", "out", "--vary", "depth=2,3"])
        .args(["--spp", "16,64", "--runs", "4", "--reference-time", "1s"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("do not show the same thing"), "{said}");
    let json = folder.json("out/results.json");
    let found = json["findings"][0].as_str().unwrap();
    assert!(
        said.contains(found) && found.contains("path depth="),
        "{found}"
    );
    // The command can be given to a shell as it is.
    let command = json["command"].as_str().unwrap();
    assert!(command.contains("study 'my ball.xml' -o out"), "{command}");
    // Samplers show the same thing.
    let line = "ball.xml -o same --vary sampler=independent,sobol --spp 16,64 --runs 4 --reference-time 1s";
    folder.write("ball.xml", BALL);
    let said = folder.done(line);
    assert!(!said.contains("do not show the same thing"), "{said}");
}

#[test]
fn the_report_holds_all_it_shows() {
    let folder = Folder::new("report");
    folder.write("ball.xml", BALL);
    folder.done("ball.xml -o out --vary sampler=independent,sobol --times 20ms,40ms --runs 3 --reference-time 1s");
    let html = folder.read("out/report.html");
    let start = html.find("id=\"data\">").unwrap() + "id=\"data\">".len();
    let end = start + html[start..].find("</script>").unwrap();
    let data: Value = serde_json::from_str(&html[start..end]).unwrap();
    assert_eq!(data["results"], folder.json("out/results.json"));
    assert_eq!(data["pictures"]["points"].as_array().unwrap().len(), 4);
    let picture = data["pictures"]["points"][3]["bias"].as_str().unwrap();
    assert!(
        picture.starts_with("data:image/png;base64,iVBORw0KGgo"),
        "{}",
        &picture[..40]
    );
    for name in ["mean.exr", "mean.png", "run.png", "error.png", "bias.png"] {
        let path = format!("out/images/path_sampler-sobol-20ms-{name}");
        assert!(folder.0.join(&path).exists(), "{path}");
    }
    let csv = folder.read("out/results.csv");
    assert_eq!(csv.lines().count(), 5);
    assert!(csv.contains("path sampler=sobol,0.04 s,"), "{csv}");
}
