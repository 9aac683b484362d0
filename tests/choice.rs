//! Choosing the integrator by trial.

#[path = "common/render.rs"]
mod render;

use std::ops::ControlFlow;

use luxel::film::Film;
use luxel::format::{Compiled, Overrides};
use luxel::render::{Choice, RenderError, Stats, Stop, Target, Work};
use render::compile_with;

/// A room with a ball of glass, lit by `emitter`.
fn room(emitter: &str, ball: &str) -> Compiled {
    let xml = format!(
        r#"<scene version="3.0.0">
            <sensor type="perspective">
                <transform name="to_world"><lookat origin="0, 1, 4" target="0, 1, 0" up="0, 1, 0"/></transform>
                <sampler type="independent"/>
                <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/>
                    <rfilter type="box"/></film>
            </sensor>
            <shape type="rectangle">
                <transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/></transform>
            </shape>
            <shape type="rectangle">
                <transform name="to_world"><scale value="3"/><translate z="-2"/></transform>
            </shape>
            <shape type="sphere"><point name="center" value="0, 0.6, 0"/><float name="radius" value="0.6"/>
                <bsdf type="{ball}"/></shape>
            {emitter}
        </scene>"#
    );
    let overrides = Overrides {
        integrator: Some("auto".to_string()),
        ..Overrides::default()
    };
    compile_with(&xml, &overrides)
}

const LAMP: &str = r#"<shape type="sphere"><point name="center" value="0.5, 2.5, 0.5"/><float name="radius" value="0.3"/>
    <emitter type="area"><rgb name="radiance" value="10"/></emitter></shape>"#;
const POINT: &str = r#"<emitter type="point"><point name="position" value="0.5, 2.5, 0.5"/>
    <rgb name="intensity" value="10"/></emitter>"#;

fn go_on(_: &str, _: &Film, _: &Stats) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn is_biased(choice: &Choice) -> bool {
    choice.trials[choice.chosen].found.as_ref().unwrap().biased
}

fn tried(choice: &Choice) -> Vec<&str> {
    let measured = choice.trials.iter().filter(|t| t.found.is_ok());
    measured.map(|t| t.options).collect()
}

/// However the choice falls, which depends on the clock.
#[test]
fn the_picture_is_that_of_the_one_that_was_chosen() {
    let target = Target {
        error: 0.2,
        quantile: None,
    };
    for stop in [
        Stop::Spp(24),
        Stop::Error {
            target,
            within: None,
        },
    ] {
        let Compiled {
            mut job, choice, ..
        } = room(LAMP, "dielectric");
        let work = Work::whole(stop);
        let (choice, film, stats) = job.choose(choice.unwrap(), &work, go_on).unwrap();
        assert!(film.samples() > 0 && stats.seconds >= stats.phases.trials);
        let (film, _) = job
            .go_on(&work, film, stats, |_, _| ControlFlow::Continue(()))
            .unwrap();
        let (alone, _) = job.render(stop, |_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(film.planes(), alone.planes(), "{choice:?}");
        assert!(choice.trials[choice.chosen].found.is_ok(), "{choice:?}");
    }
}

#[test]
fn light_that_an_integrator_cannot_find_keeps_it_from_being_tried() {
    // So many that all trials are short beside it.
    let work = Work::whole(Stop::Spp(4096));
    let Compiled {
        mut job, choice, ..
    } = room(POINT, "dielectric");
    let (choice, ..) = job.choose(choice.unwrap(), &work, go_on).unwrap();
    let photons = ["combined", "vcm", "sppm"].map(|name| format!("--integrator {name}"));
    assert_eq!(tried(&choice), photons, "{choice:?}");
    assert!(is_biased(&choice));
    // Nothing throws caustics: photons would only add a bias.
    let Compiled {
        mut job, choice, ..
    } = room(POINT, "diffuse");
    let (choice, ..) = job.choose(choice.unwrap(), &work, go_on).unwrap();
    assert!(tried(&choice).starts_with(&["--integrator path", "--integrator bdpt"]));
    assert!(!is_biased(&choice));
}

/// The caustic of a small lamp, which hardly any path finds by chance, is known to be missing by those that find it.
#[test]
fn light_that_hardly_any_sample_finds_counts() {
    let lamp = LAMP.replace("0.3", "0.003").replace("10", "100000");
    let Compiled {
        mut job, choice, ..
    } = room(&lamp, "dielectric");
    let work = Work::whole(Stop::Spp(4096));
    let (choice, ..) = job.choose(choice.unwrap(), &work, go_on).unwrap();
    let of = |name: &str| {
        let options = format!("--integrator {name}");
        let trial = choice.trials.iter().find(|t| t.options == options).unwrap();
        *trial.found.as_ref().unwrap()
    };
    let [path, bdpt] = ["path", "bdpt"].map(of);
    // By its own samples alone it would seem to be the best one.
    assert!(path.efficiency() > bdpt.efficiency(), "{choice:?}");
    // Its caustic makes a good part of the light on the floor below the ball.
    assert!(path.missed > 3e-4 && bdpt.missed < 1e-4, "{choice:?}");
    assert_ne!(choice.options(), "--integrator path");
}

#[test]
fn who_is_stopped_goes_on_with_what_there_is() {
    let Compiled {
        mut job, choice, ..
    } = room(LAMP, "dielectric");
    let work = Work::whole(Stop::Spp(64));
    let stop = |_: &str, _: &Film, _: &Stats| ControlFlow::Break(());
    let (choice, film, _) = job.choose(choice.unwrap(), &work, stop).unwrap();
    assert_eq!((choice.options(), film.spp()), ("--integrator path", 1));
}

#[test]
fn a_picture_without_noise_is_no_trouble() {
    let sky = r#"<emitter type="constant"/>"#;
    let xml = format!(r#"<scene version="3.0.0"><sensor type="perspective"/>{sky}</scene>"#);
    let overrides = Overrides {
        integrator: Some("auto".to_string()),
        resolution: Some([16, 16]),
        ..Overrides::default()
    };
    let Compiled {
        mut job, choice, ..
    } = compile_with(&xml, &overrides);
    let work = Work::whole(Stop::Spp(16));
    let (choice, ..) = job.choose(choice.unwrap(), &work, go_on).unwrap();
    // All are perfect; which of them is quickest is up to the clock.
    assert!(!is_biased(&choice), "{choice:?}");
    let json = choice.to_json().to_string();
    assert!(!json.contains("NaN"), "{json}");
}

#[test]
fn where_nothing_can_be_chosen_it_says_why() {
    let Compiled {
        mut job, choice, ..
    } = room(LAMP, "dielectric");
    let mut candidates = choice.unwrap();
    for candidate in &mut candidates {
        candidate.spec = Err("it is tired");
    }
    let work = Work::whole(Stop::Spp(4));
    let refused = job.choose(candidates, &work, go_on);
    assert!(matches!(&refused, Err(RenderError::NoChoice(_))));
    let told = refused.unwrap_err().to_string();
    assert!(told.contains("--integrator vcm: it is tired"), "{told}");
}
