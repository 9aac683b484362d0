//! The arguments of `luxel study`.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::cli::numbers::{positive, whole};
use crate::cli::render::{parse_define, parse_duration, parse_resolution};

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
    /// Independent runs of each, 3 to 1000; their spread tells noise from bias
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = whole(3..=1000usize))]
    pub runs: usize,
    /// Compare with this picture [default: one is made]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["reference_integrator", "reference_time"])]
    pub reference: Option<PathBuf>,
    /// Make the reference by this integrator [default: the most efficient of the unbiased methods that are studied, direct and ptracer last; else path]
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
pub struct SppList(pub Vec<u64>);

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

/// Errors that pictures in 32 bits can have, and a little less; beyond these, it is a slip of the hand.
const SENSIBLE: RangeInclusive<f64> = 1e-9..=1e4;

/// `1%` or `0.01`.
fn parse_share(text: &str) -> Result<f64, String> {
    let (number, factor) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let value = positive(number.trim()).map(|v| v * factor);
    let value = value.map_err(|_| "expected an error above zero such as 1%".to_string())?;
    match SENSIBLE.contains(&value) {
        true => Ok(value),
        false => Err("expected an error from 0.0000001% to 1000000%".to_string()),
    }
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
        for bad in ["", "%", "-1%", "0", "nan%", "1e300%", "1e-20"] {
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
}
