//! Pictures made in parts: shards, and renders that were stopped and gone on with, are the whole picture bit for bit.

#[path = "common/render.rs"]
mod render;

use luxel::film::Film;
use luxel::format::{Compiled, Overrides};
use luxel::render::{Identity, Metadata, Saved, Shard, Stats, Stop, Target, Work, merge};
use render::{camera, compile_with, scene};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

/// A lamp over a floor with a ball of glass, which throws a caustic.
fn job(integrator: &str, seed: u64) -> Compiled {
    let content = r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="-90"/>
            <translate y="-1"/></transform><bsdf type="diffuse"/></shape>
        <shape type="sphere"><float name="radius" value="0.7"/><bsdf type="dielectric"/></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
            <translate y="2"/></transform><emitter type="area"><rgb name="radiance" value="6"/></emitter></shape>"#;
    let overrides = Overrides {
        integrator: Some(integrator.to_string()),
        seed: Some(seed),
        aovs: vec!["normal".to_string()],
        ..Overrides::default()
    };
    compile_with(&scene(12, &camera(18, 50.0), content), &overrides)
}

fn go(_: &Film, _: &Stats) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn bits(film: &Film) -> Vec<u64> {
    let all = [film.mean(), film.standard_error()].concat().concat();
    let layer = film.aov(0);
    all.iter().chain(&layer).map(|v| v.to_bits()).collect()
}

/// By way of a file.
fn kept(job: &Compiled, work: &Work, film: &Film, stats: &Stats, name: &str) -> Saved {
    // Tests run side by side.
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("parts-{name}-{count}.exr"));
    let identity = Identity::new(&job.job, work.stop, "hash");
    let image = (job.job).to_be_saved(&identity, work, film, stats, &Metadata::default());
    image.write(&path).unwrap();
    let saved = Saved::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(identity.difference(&saved.identity), None);
    saved
}

fn shard(job: &Compiled, spp: u64, number: u64, of: u64) -> Saved {
    let work = Work {
        stop: Stop::Spp(spp),
        shard: Some(Shard { number, of }),
    };
    let (film, stats) = (job.job)
        .go_on(&work, job.job.film_for(&work), Stats::default(), go)
        .unwrap();
    let name = format!(
        "{}-{}-{number}-{of}",
        job.job.integrator.name(),
        job.job.seed
    );
    kept(job, &work, &film, &stats, &name)
}

#[test]
fn shards_come_to_the_whole() {
    for integrator in [
        "path",
        "bdpt",
        "ptracer",
        "vcm",
        "sppm",
        "combined",
        "photonmapper",
    ] {
        let job = job(integrator, 3);
        let spp = 11;
        let (whole, stats) = job.job.render(Stop::Spp(spp), go).unwrap();
        // Also more of them than there are samples.
        for of in [1, 3, 13] {
            let shards = (1..=of)
                .rev()
                .map(|n| (format!("{n}"), shard(&job, spp, n, of)));
            let merged = merge(shards.collect()).unwrap();
            assert_eq!(merged.film.range(), Some(0..spp));
            assert!(bits(&merged.film) == bits(&whole), "{integrator} of {of}");
            // What all share is shot by each of them.
            if integrator != "photonmapper" {
                assert_eq!(merged.stats.rays, stats.rays, "{integrator} of {of}");
            }
        }
    }
}

#[test]
fn what_does_not_belong_together_is_not_joined() {
    let one = job("path", 3);
    let part = |number| (format!("part {number}"), shard(&one, 8, number, 3));
    let refused = |shards: Vec<(String, Saved)>| merge(shards).map(|_| ()).unwrap_err();
    assert_eq!(refused(vec![part(3)]), "shards are missing: 1/3, 2/3");
    assert_eq!(
        refused(vec![part(2), part(1), part(2), part(3)]),
        "part 2 and part 2 are the same shard, 2 of 3"
    );
    let other = ("other".to_string(), shard(&job("path", 4), 8, 2, 3));
    assert_eq!(
        refused(vec![part(1), other, part(3)]),
        "other does not belong to part 1: seed: 4 there, 3 here"
    );
    let other = ("other".to_string(), shard(&one, 8, 2, 4));
    assert_eq!(
        refused(vec![part(1), other]),
        "other is one of 4 shards, part 1 one of 3: they do not belong together"
    );
    let work = Work {
        stop: Stop::Spp(8),
        shard: Some(Shard { number: 2, of: 3 }),
    };
    let film = one.job.film_for(&work);
    let empty = || {
        let saved = kept(&one, &work, &film, &Stats::default(), "empty");
        ("empty".to_string(), saved)
    };
    let what = refused(vec![part(1), empty(), part(3)]);
    assert_eq!(
        what,
        "empty is not complete: 0 of its samples per pixel are there; go on with it by --shard 2/3 --resume"
    );
    let what = refused(vec![empty(), part(3)]);
    assert!(
        what.ends_with("; with it, 2 of 3 shards are missing or not complete: 1/3, 2/3"),
        "{what}"
    );
    // A checkpoint beside the shard that it became does no harm.
    let merged = merge(vec![empty(), part(1), part(2), part(3)]).unwrap();
    assert_eq!(merged.film.range(), Some(0..8));
    assert!(refused(Vec::new()).contains("no shards"));
}

/// What was stopped after every pass, kept and gone on with.
fn in_steps(job: &Compiled, work: &Work, name: &str) -> Film {
    let (mut film, mut stats) = (job.job.film_for(work), Stats::default());
    loop {
        let mut stopped = false;
        let stop = |_: &Film, _: &Stats| {
            stopped = true;
            ControlFlow::Break(())
        };
        (film, stats) = job.job.go_on(work, film, stats, stop).unwrap();
        let saved = kept(job, work, &film, &stats, name);
        (film, stats) = (saved.film, saved.stats);
        if !stopped {
            return film;
        }
    }
}

#[test]
fn what_was_stopped_goes_on_as_if_it_had_not_been() {
    let target = |error| Stop::Error {
        target: Target {
            error,
            quantile: None,
        },
        within: None,
    };
    for (integrator, stop) in [
        ("path", Stop::Spp(37)),
        ("vcm", Stop::Spp(9)),
        ("sppm", Stop::Spp(9)),
        ("path", target(0.3)),
        ("vcm", target(0.2)),
    ] {
        let job = job(integrator, 5);
        let work = Work::whole(stop);
        let (whole, _) = job.job.render(stop, go).unwrap();
        let film = in_steps(
            &job,
            &work,
            &format!("steps-{integrator}-{}", film_kind(stop)),
        );
        assert!(film.samples() > 0);
        assert_eq!(film.counts(), whole.counts(), "{integrator} {stop:?}");
        assert!(bits(&film) == bits(&whole), "{integrator} {stop:?}");
    }
}

fn film_kind(stop: Stop) -> &'static str {
    match stop {
        Stop::Error { .. } => "error",
        _ => "spp",
    }
}

#[test]
fn files_that_hold_no_part_of_a_picture_are_told() {
    let job = job("path", 1);
    let (film, stats) = job.job.render(Stop::Spp(2), go).unwrap();
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("parts-picture.exr");
    let picture = job.job.picture(&film, &stats, &Metadata::default());
    picture.write(&path).unwrap();
    let what = Saved::read(&path).unwrap_err();
    assert!(what.contains("neither a checkpoint nor a shard"), "{what}");
    // Cut off.
    let work = Work::whole(Stop::Spp(2));
    let identity = Identity::new(&job.job, work.stop, "hash");
    let image = (job.job).to_be_saved(&identity, &work, &film, &stats, &Metadata::default());
    image.write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 100, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(
            Saved::read(&path).is_err(),
            "{length} of {} bytes",
            bytes.len()
        );
    }
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_part_whose_sums_are_damaged_is_refused() {
    let job = job("path", 0);
    let work = Work::whole(Stop::Spp(8));
    let (film, stats) = job.job.render(work.stop, go).unwrap();
    let identity = Identity::new(&job.job, work.stop, "hash");
    let image = (job.job).to_be_saved(&identity, &work, &film, &stats, &Metadata::default());
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("parts-damaged.exr");
    image.write(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let (mut refused, mut same) = (0, 0);
    for i in 0..60 {
        let mut bytes = whole.clone();
        let at = whole.len() * (i + 40) / 100;
        bytes[at] ^= 0x40;
        std::fs::write(&path, &bytes).unwrap();
        match Saved::read(&path) {
            Err(_) => refused += 1,
            // It is the picture that is damaged, which is made anew of the sums.
            Ok(saved) => {
                assert_eq!(saved.film.planes(), film.planes());
                same += 1;
            }
        }
    }
    // The sums are most of the file.
    assert!(refused > 3 * same, "{refused} refused, {same} the same");
    std::fs::remove_file(&path).unwrap();
}
