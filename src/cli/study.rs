//! `luxel study`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;

use super::numbers::whole;
use super::render::{
    parse_define, parse_duration, parse_resolution, pool, scene_name, watch_for_interrupt,
};
use super::{Failure, Outcome};
use crate::format::{self, Compiled, Overrides};
use crate::study::plan::{Amount, Method, Plan, ReferenceChoice, Study, StudyError};
use crate::study::sweep::{self, Findings};
use crate::study::{report, results};

/// Measure how error falls with samples and time, for several integrators or settings, and write a report
///
/// Renders the scene by every method at every number of samples (or time) in several independent runs,
/// compares all with a reference, and writes results.csv, results.json, pictures and report.html to DIR.
/// What is there from an earlier study of the same scene is used again: after a stop, the same command goes on.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// Scene file in Mitsuba's XML; without it, the scene built into the program
    pub scene: Option<PathBuf>,
    /// Folder to keep everything in: new, empty, or of an earlier study of this scene
    #[arg(short, long = "output", value_name = "DIR")]
    pub output: PathBuf,
    /// Integrators to compare [default: the scene's]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub integrators: Vec<String>,
    /// Settings to compare: values of a parameter that the scene names with <default>, or of sampler or
    /// indirect; given several times, all combinations. They must not change what the scene truly looks like
    #[arg(long, value_name = "NAME=VALUE,...", value_parser = parse_vary)]
    pub vary: Vec<(String, Vec<String>)>,
    /// Samples per pixel: 1..64 doubles from 1 to 64; or a list such as 16,100 [default: 1..64]
    #[arg(long, value_name = "A..B", value_parser = parse_spp, conflicts_with = "times")]
    pub spp: Option<SppList>,
    /// Times in place of samples: 1s,10s,1m
    #[arg(long, value_name = "TIME,...", value_delimiter = ',', value_parser = parse_duration)]
    pub times: Vec<Duration>,
    /// Independent runs of each; their spread tells noise from bias
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = whole(3..=1000usize))]
    pub runs: usize,
    /// Compare with this picture [default: one is made]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["reference_integrator", "reference_time"])]
    pub reference: Option<PathBuf>,
    /// Make the reference by this integrator [default: the first unbiased one that is studied, else path]
    #[arg(long, value_name = "NAME")]
    pub reference_integrator: Option<String>,
    /// Most time to make the reference in; it ends earlier when its error is 10 times below the smallest one studied
    /// [default: 10m]
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub reference_time: Option<Duration>,
    /// Relative errors to forecast samples and time for
    #[arg(long, value_name = "ERROR,...", value_delimiter = ',', default_value = "1%", value_parser = parse_share)]
    pub want: Vec<f64>,
    /// Use this sampler in place of the scene's: sobol, independent
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<String>,
    /// Longest path: 1 shows emitters only, 2 adds direct light, -1 sets no limit
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(-1..=1_000_000i64))]
    pub max_depth: Option<i64>,
    /// Set a parameter of the scene that it names with <default>
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    pub define: Vec<(String, String)>,
    /// Size of the picture, in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    pub resolution: Option<[u32; 2]>,
    /// What the seeds of all runs are made from
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = whole(0..=u64::MAX))]
    pub seed: u64,
    /// Threads to render with [default: one per processor]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=u16::MAX))]
    pub threads: Option<u16>,
}

/// Numbers of samples per pixel, increasing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SppList(Vec<u64>);

/// Most settings of samples or of one parameter, against slips of the hand.
const MOST_VALUES: usize = 64;

fn parse_spp(text: &str) -> Result<SppList, String> {
    let number = whole(1..=1u64 << 40);
    let mut list = Vec::new();
    if let Some((first, last)) = text.split_once("..") {
        let (first, last) = (number(first.trim())?, number(last.trim())?);
        if first > last {
            return Err(format!("{first} is more than {last}"));
        }
        let doubled = std::iter::successors(Some(first), |n| Some(2 * n));
        list.extend(doubled.take_while(|n| *n <= last));
    } else {
        for part in text.split(',') {
            list.push(number(part.trim())?);
        }
    }
    list.sort_unstable();
    list.dedup();
    match list.len() {
        0..=MOST_VALUES => Ok(SppList(list)),
        n => Err(format!("{n} numbers are more than {MOST_VALUES}")),
    }
}

fn parse_vary(text: &str) -> Result<(String, Vec<String>), String> {
    let (name, values) = text.split_once('=').ok_or("expected NAME=VALUE,...")?;
    let values: Vec<String> = values.split(',').map(|v| v.trim().to_string()).collect();
    if name.is_empty() || values.iter().any(String::is_empty) {
        return Err("expected NAME=VALUE,...".to_string());
    }
    if let Some(twice) = (1..values.len()).find(|i| values[..*i].contains(&values[*i])) {
        return Err(format!("{} is given twice", values[twice]));
    }
    match values.len() {
        0..=MOST_VALUES => Ok((name.to_string(), values)),
        n => Err(format!("{n} values are more than {MOST_VALUES}")),
    }
}

/// `1%` or `0.01`.
fn parse_share(text: &str) -> Result<f64, String> {
    let (number, factor) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let value = super::numbers::positive(number.trim()).map(|v| v * factor);
    value.map_err(|_| "expected an error above zero such as 1%".to_string())
}

/// One way to render: what the command line varies.
#[derive(Clone, Debug, Default)]
struct Variant {
    integrator: Option<String>,
    sampler: Option<String>,
    indirect: Option<String>,
    /// Values for parameters of the scene.
    defines: Vec<(String, String)>,
    /// What tells it from the others, but for the integrator.
    label: Vec<String>,
}

impl Variant {
    /// In place of what was set before.
    fn set(&mut self, name: &str, value: &str) {
        let value = value.to_string();
        let before = format!("{name}=");
        self.label.retain(|part| !part.starts_with(&before));
        self.label.push(format!("{name}={value}"));
        match name {
            "sampler" => self.sampler = Some(value),
            "indirect" => self.indirect = Some(value),
            _ => self.defines.push((name.to_string(), value)),
        }
    }
}

/// All combinations of what is varied.
fn variants(args: &StudyArgs) -> Vec<Variant> {
    let integrators: Vec<Option<String>> = match args.integrators.is_empty() {
        true => vec![None],
        false => args.integrators.iter().cloned().map(Some).collect(),
    };
    let first = |integrator| Variant {
        integrator,
        sampler: args.sampler.clone(),
        ..Variant::default()
    };
    let mut all: Vec<Variant> = integrators.into_iter().map(first).collect();
    for (name, values) in &args.vary {
        let with = |v: &Variant| {
            let v = v.clone();
            values.iter().map(move |value| {
                let mut v = v.clone();
                v.set(name, value);
                v
            })
        };
        all = all.iter().flat_map(with).collect();
    }
    all
}

/// The scene under a variant.
fn compile(args: &StudyArgs, variant: &Variant) -> Result<(Compiled, String), Failure> {
    let mut defines = args.define.clone();
    defines.retain(|(name, _)| variant.defines.iter().all(|(n, _)| n != name));
    defines.extend(variant.defines.iter().cloned());
    let desc = match &args.scene {
        Some(path) => format::load(path, &defines)?,
        None => format::load_built_in(&defines)?,
    };
    let overrides = Overrides {
        integrator: variant.integrator.clone(),
        indirect: variant.indirect.clone(),
        sampler: variant.sampler.clone(),
        max_depth: args.max_depth,
        resolution: args.resolution,
        ..Overrides::default()
    };
    let compiled = format::compile(&desc, &overrides)?;
    let settings = format!(
        "{}|{}|{overrides:?}",
        env!("CARGO_PKG_VERSION"),
        desc.hash()
    );
    Ok((compiled, settings))
}

/// A method of the study; `warned` are warnings that were printed already.
fn method(
    args: &StudyArgs,
    variant: &Variant,
    warned: &mut Vec<String>,
) -> Result<Method, Failure> {
    let (compiled, settings) = compile(args, variant)?;
    for warning in compiled.warnings {
        if !warned.contains(&warning) {
            eprintln!("warning: {warning}");
            warned.push(warning);
        }
    }
    let mut label = vec![compiled.job.integrator.name().to_string()];
    label.extend(variant.label.iter().cloned());
    Ok(Method {
        label: label.join(" "),
        settings,
        arguments: arguments(args, variant),
        job: compiled.job,
    })
}

/// The arguments of `luxel render` that make a variant.
fn arguments(args: &StudyArgs, variant: &Variant) -> String {
    let mut parts = Vec::new();
    let mut add = |option: &str, value: &str| {
        if !option.is_empty() {
            parts.push(option.to_string());
        }
        parts.push(quoted(value));
    };
    if let Some(scene) = &args.scene {
        add("", &scene.to_string_lossy());
    }
    let chosen = [
        ("--integrator", &variant.integrator),
        ("--indirect", &variant.indirect),
        ("--sampler", &variant.sampler),
    ];
    for (option, value) in chosen {
        value.iter().for_each(|v| add(option, v));
    }
    let varied = |name: &str| variant.defines.iter().any(|(n, _)| n == name);
    let fixed = args.define.iter().filter(|(name, _)| !varied(name));
    for (name, value) in fixed.chain(&variant.defines) {
        add("-D", &format!("{name}={value}"));
    }
    if let Some([width, height]) = args.resolution {
        add("--resolution", &format!("{width}x{height}"));
    }
    if let Some(depth) = args.max_depth {
        add("--max-depth", &depth.to_string());
    }
    if let Some(threads) = args.threads {
        add("--threads", &threads.to_string());
    }
    parts.join(" ")
}

/// For a shell of Unix.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=,:+@%".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_string(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

/// What makes the reference: the method asked for, or the first that is unbiased, or path tracing.
fn reference(
    args: &StudyArgs,
    variants: &[Variant],
    methods: &[Method],
    warned: &mut Vec<String>,
) -> Result<ReferenceChoice, Failure> {
    if let Some(path) = &args.reference {
        return Ok(ReferenceChoice::File(path.clone()));
    }
    let mut variant = match &args.reference_integrator {
        Some(name) => Variant {
            integrator: Some(name.clone()),
            ..variants[0].clone()
        },
        None => {
            let unbiased = methods.iter().position(|m| !m.job.integrator.biased());
            match unbiased {
                Some(i) => variants[i].clone(),
                None => {
                    let mut path = variants[0].clone();
                    path.integrator = Some("path".to_string());
                    path.set("indirect", "none");
                    path
                }
            }
        }
    };
    // Its error falls fastest, whatever is studied.
    variant.set("sampler", "sobol");
    let method = method(args, &variant, warned)?;
    if method.job.integrator.biased() {
        eprintln!(
            "warning: the reference is made by {}, which is biased: errors below its bias mean nothing",
            method.label
        );
    }
    Ok(ReferenceChoice::Made {
        method: Box::new(method),
        limit: args.reference_time.unwrap_or(Duration::from_secs(600)),
    })
}

fn plan(args: &StudyArgs, threads: usize, command_line: &str) -> Result<Plan, Failure> {
    let (base, _) = compile(args, &Variant::default())?;
    let crop = base.job.film.crop;
    let mut amounts: Vec<Amount> = match (&args.spp, args.times.is_empty()) {
        (_, false) => args.times.iter().copied().map(Amount::Time).collect(),
        (Some(SppList(list)), true) => list.iter().copied().map(Amount::Spp).collect(),
        (None, true) => (0..=6).map(|k| Amount::Spp(1 << k)).collect(),
    };
    amounts.sort_unstable();
    amounts.dedup();
    let scene = scene_name(args.scene.as_deref());
    Ok(Plan {
        folder: args.output.clone(),
        identity: vec![
            ("scene", scene.clone()),
            ("content", base.hash),
            ("size", format!("{}x{}", crop.width, crop.height)),
            (
                "max_depth",
                args.max_depth
                    .map_or("scene's".to_string(), |d| d.to_string()),
            ),
        ],
        scene,
        amounts,
        runs: args.runs,
        base_seed: args.seed,
        wanted: args.want.clone(),
        threads,
        command_line: command_line.to_string(),
    })
}

impl From<StudyError> for Failure {
    fn from(e: StudyError) -> Failure {
        match e {
            StudyError::Input(what) => Failure::Input(what),
            StudyError::Output(what) => Failure::Output(what),
        }
    }
}

pub fn run(args: &StudyArgs, command_line: &str) -> Result<Outcome, Failure> {
    let stopped = Arc::new(AtomicBool::new(false));
    watch_for_interrupt(&stopped, "pass")?;
    let pool = pool(args.threads)?;
    let mut study = pool.install(|| {
        let plan = plan(args, pool.current_num_threads(), command_line)?;
        let variants = variants(args);
        let mut warned = Vec::new();
        let methods: Result<Vec<Method>, Failure> = variants
            .iter()
            .map(|v| method(args, v, &mut warned))
            .collect();
        let methods = methods?;
        check_labels(&methods)?;
        let reference = reference(args, &variants, &methods, &mut warned)?;
        Ok::<Study, Failure>(Study {
            plan,
            methods,
            reference,
        })
    })?;
    let stop = || stopped.load(Ordering::Relaxed);
    let found = pool.install(|| sweep::run(&mut study, &stop, &mut |line| eprintln!("{line}")))?;
    let Some(findings) = found else {
        eprintln!("stopped; the same command goes on from here");
        return Ok(Outcome::Interrupted);
    };
    conclude(&study, &findings);
    Ok(Outcome::Done)
}

/// Two methods of one name would have one name of their files too.
fn check_labels(methods: &[Method]) -> Result<(), Failure> {
    let twice =
        (1..methods.len()).find(|i| methods[..*i].iter().any(|m| m.label == methods[*i].label));
    match twice {
        Some(i) => Err(Failure::Usage(format!(
            "{} is studied twice",
            methods[i].label
        ))),
        None => Ok(()),
    }
}

/// A line per method, and where to look.
fn conclude(study: &Study, findings: &Findings) {
    if let (Some(false), Some(own)) = (findings.reference_good, findings.reference.rel_mse) {
        eprintln!(
            "warning: the reference's own error of {:.2} % is less than 10 times below the smallest one studied: it is \
             in the intervals, and falls with a longer --reference-time or a --reference",
            100.0 * own.sqrt()
        );
    }
    let invalid: u64 = findings
        .rows
        .iter()
        .flat_map(|r| &r.records)
        .map(|r| r.invalid)
        .sum();
    if invalid > 0 {
        eprintln!(
            "warning: {invalid} samples were NaN, infinite or negative and are left out: a fault of luxel, please report it"
        );
    }
    let json = results::to_json(study, findings);
    for line in results::summary(&json) {
        println!("{line}");
    }
    let folder: &Path = &study.plan.folder;
    println!(
        "wrote {}, {} and {}",
        folder.join(report::NAME).display(),
        results::CSV_NAME,
        results::JSON_NAME
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_double_or_are_listed() {
        assert_eq!(parse_spp("1..8"), Ok(SppList(vec![1, 2, 4, 8])));
        assert_eq!(parse_spp("3..13"), Ok(SppList(vec![3, 6, 12])));
        assert_eq!(parse_spp("64,16,16"), Ok(SppList(vec![16, 64])));
        for bad in [
            "",
            "8..1",
            "0..4",
            "1..",
            "x",
            "1,,2",
            "-1..4",
            "1..99999999999999999999",
        ] {
            assert!(parse_spp(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn errors_are_percentages_or_shares() {
        assert_eq!(
            (parse_share("1%"), parse_share("0.02")),
            (Ok(0.01), Ok(0.02))
        );
        for bad in ["", "%", "-1%", "0", "nan%"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn what_is_varied_has_a_name_and_values() {
        let two = vec!["1".to_string(), "2".to_string()];
        assert_eq!(parse_vary("photons=1, 2"), Ok(("photons".to_string(), two)));
        for bad in ["photons", "=1", "photons=", "photons=1,,2", "photons=1,1"] {
            assert!(parse_vary(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn shells_read_arguments_as_they_are() {
        assert_eq!(quoted("a/b.xml"), "a/b.xml");
        assert_eq!(quoted("it's $x"), r"'it'\''s $x'");
    }
}
