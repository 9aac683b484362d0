//! What the user sees while a picture is rendered.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::film::Film;
use crate::render::{Stats, Stop, percent};

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressMode {
    /// A bar on a terminal, plain lines elsewhere
    Auto,
    /// Nothing on the way: only the result, and warnings
    Never,
}

/// Shows the progress of one rendering on stderr.
pub enum Progress {
    Off,
    Bar(ProgressBar),
    Lines { last: Instant },
}

/// Time between two plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// Steps of the bar.
const STEPS: u64 = 1000;

impl Progress {
    pub fn new(mode: ProgressMode) -> Progress {
        match mode {
            ProgressMode::Never => Progress::Off,
            ProgressMode::Auto if std::io::stderr().is_terminal() => {
                let bar = ProgressBar::new(STEPS);
                let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}");
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                Progress::Bar(bar)
            }
            ProgressMode::Auto => Progress::Lines {
                last: Instant::now(),
            },
        }
    }

    pub fn update(&mut self, film: &Film, stats: &Stats, stop: Stop) {
        match self {
            Progress::Off => {}
            Progress::Bar(bar) => {
                bar.set_position((done(film, stats, stop) * STEPS as f64) as u64);
                bar.set_message(message(film, stats, stop));
            }
            Progress::Lines { last } => {
                if last.elapsed() >= LINE_EVERY {
                    *last = Instant::now();
                    let share = 100.0 * done(film, stats, stop);
                    eprintln!("{share:.0} %  {}", message(film, stats, stop));
                }
            }
        }
    }

    /// That an integrator is tried before one is chosen.
    pub fn trying(&mut self, options: &str, film: &Film, stats: &Stats) {
        if let Progress::Bar(bar) = self {
            bar.set_message(match stats.solving {
                Some(_) => format!("trying {options}: solving for radiosity"),
                None => format!("trying {options}: {} spp", film.spp()),
            });
        }
    }

    /// Prints a warning, above the bar if there is one.
    pub fn warn(&self, warning: &str) {
        let print = || eprintln!("warning: {warning}");
        match self {
            Progress::Bar(bar) => bar.suspend(print),
            _ => print(),
        }
    }

    pub fn finish(&self) {
        if let Progress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Share of the work that is done, 0 to 1.
fn done(film: &Film, stats: &Stats, stop: Stop) -> f64 {
    match stop {
        Stop::Spp(n) => film.spp() as f64 / n.max(1) as f64,
        Stop::Time(limit) => (stats.seconds / limit.as_secs_f64().max(1e-9)).min(1.0),
        // Squared errors fall as samples rise.
        Stop::Error { target, within } => {
            let good = film
                .estimate_error()
                .map_or(0.0, |e| match target.quantile {
                    None if e.relmse > 0.0 => (target.error.powi(2) / e.relmse).min(1.0),
                    _ => 0.0,
                });
            let late = within.map_or(0.0, |limit| stats.seconds / limit.as_secs_f64().max(1e-9));
            good.max(late).min(1.0)
        }
    }
}

fn message(film: &Film, stats: &Stats, stop: Stop) -> String {
    if let Some(at) = &stats.solving {
        return format!(
            "solving radiosity: step {}, {} patches, residual {:.1e}, {}",
            at.step,
            at.patches,
            at.residual,
            human_seconds(stats.seconds)
        );
    }
    let left = stats.seconds * (1.0 / done(film, stats, stop).max(1e-6) - 1.0);
    let error = match film.estimate_error() {
        Some(e) => format!("error {:.2} %", percent(&e)[0]),
        None => "error unknown yet".to_string(),
    };
    format!(
        "{} spp  {:.2} Mrays/s  {error}  {} left",
        film.spp(),
        stats.rays_per_second() / 1e6,
        human_seconds(left)
    )
}

/// Shows on stderr how far a solver of radiosity has come.
pub enum Steps {
    Off,
    Line {
        bar: ProgressBar,
        start: Instant,
        last: Instant,
    },
    Lines {
        start: Instant,
        last: Instant,
    },
}

impl Steps {
    pub fn new(mode: ProgressMode) -> Steps {
        let (start, last) = (Instant::now(), Instant::now());
        match mode {
            ProgressMode::Never => Steps::Off,
            ProgressMode::Auto if std::io::stderr().is_terminal() => {
                let bar = ProgressBar::new_spinner();
                Steps::Line { bar, start, last }
            }
            ProgressMode::Auto => Steps::Lines { start, last },
        }
    }

    pub fn update(&mut self, at: &crate::radiosity::Progress) {
        /// Steps can be many in a second.
        const OFTEN: Duration = Duration::from_millis(100);
        let text = |start: &Instant| {
            format!(
                "step {}  {} patches  residual {:.1e}  {}",
                at.step,
                at.mesh.len(),
                at.residual,
                human_seconds(start.elapsed().as_secs_f64())
            )
        };
        match self {
            Steps::Line { bar, start, last } if last.elapsed() >= OFTEN => {
                *last = Instant::now();
                bar.set_message(text(start));
                bar.tick();
            }
            Steps::Lines { start, last } if last.elapsed() >= LINE_EVERY => {
                *last = Instant::now();
                eprintln!("{}", text(start));
            }
            _ => {}
        }
    }

    pub fn finish(&self) {
        if let Steps::Line { bar, .. } = self {
            bar.finish_and_clear();
        }
    }
}

/// `3.2 s`, `2 min 5 s`, `1 h 12 min`.
pub fn human_seconds(s: f64) -> String {
    match s {
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s => format!(
            "{} h {} min",
            (s / 3600.0) as u64,
            (s % 3600.0 / 60.0) as u64
        ),
    }
}
