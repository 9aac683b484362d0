//! `luxel info`.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::render::parse_define;
use super::{Failure, Outcome};
use crate::format::{self, Overrides, plugins};
use crate::render::Job;

#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Scene file in Mitsuba's XML; without it, the scene built into the program
    pub scene: Option<PathBuf>,
    /// Set a parameter of the scene that it names with <default>
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    pub define: Vec<(String, String)>,
    /// List every plugin and parameter that is supported, and exit
    #[arg(long, conflicts_with_all = ["scene", "define", "json"])]
    pub plugins: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &InfoArgs) -> Result<Outcome, Failure> {
    if args.plugins {
        show(&plugins::reference());
        return Ok(Outcome::Done);
    }
    let desc = match &args.scene {
        Some(path) => format::load(path, &args.define)?,
        None => format::load_built_in(&args.define)?,
    };
    let compiled = format::compile(&desc, &Overrides::default())?;
    let job = &compiled.job;
    let plan = &job.scene.plan().entries;
    if args.json {
        let plan: Vec<_> = plan
            .iter()
            .map(|e| json!({ "subject": e.subject, "decision": e.decision, "reason": e.reason }))
            .collect();
        let facts: serde_json::Map<_, _> = facts(job, compiled.spp)
            .into_iter()
            .map(|(k, v)| (k.to_string(), v.into()))
            .collect();
        let info = json!({
            "film": { "width": job.film.crop.width, "height": job.film.crop.height },
            "spp": compiled.spp,
            "contains": facts,
            "plan": plan,
            "warnings": compiled.warnings,
        });
        show(&format!("{info:#}\n"));
        return Ok(Outcome::Done);
    }
    let mut text = "Contains\n".to_string();
    for (name, value) in facts(job, compiled.spp) {
        text += &format!("  {name:<12} {value}\n");
    }
    text += "\nModelled\n";
    for e in plan {
        text += &format!(
            "  {:<15} {}\n                  because {}\n",
            e.subject, e.decision, e.reason
        );
    }
    for warning in &compiled.warnings {
        text += &format!("\nwarning: {warning}\n");
    }
    show(&text);
    Ok(Outcome::Done)
}

/// Prints as much as the reader takes: a pipe that closes early is no fault.
fn show(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

fn facts(job: &Job, spp: u64) -> Vec<(&'static str, String)> {
    let counts = job.scene.counts();
    let crop = job.film.crop;
    let mut facts = vec![
        (
            "film",
            format!("{} x {} pixels", job.film.width, job.film.height),
        ),
        (
            "samples",
            format!("{spp} per pixel, {}", job.sampler.name()),
        ),
        ("integrator", job.integrator.name().to_string()),
        (
            "shapes",
            format!(
                "{} ({} triangles, {} exact)",
                counts.shapes, counts.triangles, counts.analytic
            ),
        ),
        ("instances", counts.instances.to_string()),
        ("materials", counts.materials.to_string()),
        ("emitters", counts.emitters.to_string()),
        (
            "memory",
            format!(
                "{} for geometry and its hierarchy",
                human_bytes(counts.geometry_bytes)
            ),
        ),
    ];
    if (crop.width, crop.height) != (job.film.width, job.film.height) {
        let text = format!(
            "{} x {} pixels at ({}, {})",
            crop.width, crop.height, crop.x, crop.y
        );
        facts.insert(1, ("crop", text));
    }
    facts
}

/// `312 bytes`, `4.2 kB`, `1.7 MB`, `3.0 GB`.
fn human_bytes(n: usize) -> String {
    match n as f64 {
        b if b < 1e3 => format!("{n} bytes"),
        b if b < 1e6 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.1} GB", b / 1e9),
    }
}
