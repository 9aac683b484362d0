//! `luxel study`.

mod args;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::render::{pool, scene_name, watch_for_interrupt};
use super::{Failure, Outcome};
use crate::format::{self, Compiled, Overrides};
use crate::study::plan::{Amount, Method, Plan, ReferenceChoice, Study, StudyError};
use crate::study::reference::TIMES_BELOW;
use crate::study::sweep::{self, Findings};
use crate::study::{report, results};
use args::SppList;

pub use args::StudyArgs;

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
struct Built {
    compiled: Compiled,
    /// Hash of the scene and the files that it names.
    content: String,
    /// Everything that determines pictures, but for seed and amount.
    settings: String,
}

fn build(args: &StudyArgs, variant: &Variant) -> Result<Built, Failure> {
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
    if compiled.choice.is_some() {
        let what = "integrators of a study are named: auto may take another one in each run";
        return Err(Failure::Usage(what.to_string()));
    }
    let content = desc
        .content_hash()
        .map_err(|e| Failure::Input(format!("cannot read a file that the scene names: {e}")))?;
    let settings = format!("{}|{content}|{overrides:?}", env!("CARGO_PKG_VERSION"));
    Ok(Built {
        compiled,
        content,
        settings,
    })
}

/// A method of the study; `warned` are warnings that were printed already.
fn method(
    args: &StudyArgs,
    variant: &Variant,
    warned: &mut Vec<String>,
) -> Result<Method, Failure> {
    let Built {
        compiled, settings, ..
    } = build(args, variant)?;
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

/// An argument as a shell of Unix reads it.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=,:+@%".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_string(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

/// What makes the reference: the method asked for, or path tracing where no method that is studied is unbiased;
/// else the study chooses among them.
fn reference(
    args: &StudyArgs,
    first: &Variant,
    methods: &[Method],
    warned: &mut Vec<String>,
) -> Result<ReferenceChoice, Failure> {
    if let Some(path) = &args.reference {
        return Ok(ReferenceChoice::File(path.clone()));
    }
    let limit = args.reference_time.unwrap_or(Duration::from_secs(600));
    let mut variant = first.clone();
    match &args.reference_integrator {
        Some(name) => variant.integrator = Some(name.clone()),
        None if methods.iter().any(|m| !m.job.integrator.biased()) => {
            let method = None;
            return Ok(ReferenceChoice::Made { method, limit });
        }
        None => {
            variant.integrator = Some("path".to_string());
            variant.set("indirect", "none");
        }
    }
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
        method: Some(Box::new(method)),
        limit,
    })
}

fn plan(args: &StudyArgs, threads: usize, command_line: &str) -> Result<Plan, Failure> {
    let base = build(args, &Variant::default())?;
    let crop = base.compiled.job.film.crop;
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
            ("content", base.content),
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
        let reference = reference(args, &variants[0], &methods, &mut warned)?;
        Ok::<Study, Failure>(Study {
            plan,
            methods,
            reference,
        })
    })?;
    let stop = || stopped.load(Ordering::Relaxed);
    let found = pool.install(|| sweep::run(&mut study, &stop, &mut |line| eprintln!("{line}")))?;
    let Some(findings) = found else {
        eprintln!("stopped: {}", kept_so_far(&study.plan.folder));
        return Ok(Outcome::Interrupted);
    };
    conclude(&study, &findings);
    Ok(Outcome::Done)
}

/// What an interrupted study leaves behind, and how to go on.
fn kept_so_far(folder: &Path) -> String {
    let is_run = |e: &std::fs::DirEntry| e.path().extension().is_some_and(|e| e == "exr");
    let runs = std::fs::read_dir(folder.join("runs"))
        .map_or(0, |entries| entries.flatten().filter(is_run).count());
    let name = folder.display();
    format!(
        "{runs} finished runs and what is done of the reference are kept in {name}; the run that was interrupted is not. \
         The same command goes on from there; results and report are written at its end"
    )
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

/// What a reference that is not good enough means for the figures.
fn warn_of_reference(findings: &Findings) {
    let (Some(times), Some(own)) = (findings.times_below, findings.reference.rel_mse) else {
        return;
    };
    if times >= TIMES_BELOW {
        return;
    }
    let own = 100.0 * own.sqrt();
    let advice = "give it a longer --reference-time or a --reference";
    if times <= 1.0 {
        eprintln!(
            "warning: the reference's own error of {own:.3} % is not below the smallest one studied, which is hardly seen \
             beside it: {advice}"
        );
    } else {
        eprintln!(
            "warning: the reference's own error of {own:.3} % is {times:.1} times below the smallest one studied, not \
             {TIMES_BELOW}. Of the smallest relMSE as measured, {:.1} % was the reference's: it is taken off, of errors, \
             bias and slopes, and its doubt is in their intervals; it cannot be taken off FLIP. To do better, {advice}",
            100.0 / (1.0 + times * times)
        );
    }
}

/// A line per method, and where to look.
fn conclude(study: &Study, findings: &Findings) {
    warn_of_reference(findings);
    for remark in &findings.remarks {
        eprintln!("warning: {remark}");
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
    fn shells_read_arguments_as_they_are() {
        assert_eq!(quoted("a/b.xml"), "a/b.xml");
        assert_eq!(quoted("it's $x"), r"'it'\''s $x'");
    }
}
