//! What a study is made of: methods, amounts of work, runs; and the names, seeds and hashes that follow.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use serde_json::{Value, json};

use crate::image_io::ImageError;
use crate::render::{Job, Stop};
use crate::sampler::mix;

/// How much work a run does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Amount {
    /// Samples per pixel, at least 1.
    Spp(u64),
    /// Time on the clock.
    Time(Duration),
}

impl Amount {
    /// When a run of this amount stops.
    pub fn stop(self) -> Stop {
        match self {
            Amount::Spp(n) => Stop::Spp(n),
            Amount::Time(time) => Stop::Time(time),
        }
    }

    /// For commands: `--spp 64`, `--time 1500ms`.
    pub fn arguments(self) -> String {
        match self {
            Amount::Spp(n) => format!("--spp {n}"),
            Amount::Time(time) => format!("--time {}ms", time.as_millis()),
        }
    }

    /// For names of files.
    fn slug(self) -> String {
        match self {
            Amount::Spp(n) => format!("{n}spp"),
            Amount::Time(time) => format!("{}ms", time.as_millis()),
        }
    }

    fn number(self) -> u64 {
        match self {
            Amount::Spp(n) => n,
            // Told apart from samples.
            Amount::Time(time) => mix(time.as_millis() as u64),
        }
    }
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Amount::Spp(n) => write!(f, "{n} spp"),
            Amount::Time(time) => write!(f, "{} s", time.as_secs_f64()),
        }
    }
}

/// A way to render the scene: an integrator, and what is varied about it or the scene.
#[derive(Debug)]
pub struct Method {
    /// For people: `path`, or `photonmapper photons=1000`.
    pub label: String,
    /// Everything that determines its pictures, but for seed and amount, as text.
    pub settings: String,
    /// The arguments of `luxel render` that make it, the scene first.
    pub arguments: String,
    pub job: Job,
}

/// What the errors are measured against.
#[derive(Debug)]
pub enum ReferenceChoice {
    /// A picture that is given.
    File(PathBuf),
    /// Made in at most this time: by this method, or by the most efficient of the unbiased ones that are
    /// studied, of which there is one then.
    Made {
        method: Option<Box<Method>>,
        limit: Duration,
    },
}

/// A study: all methods at all amounts, in several runs each.
#[derive(Debug)]
pub struct Study {
    pub plan: Plan,
    /// At least one, all of one size of picture.
    pub methods: Vec<Method>,
    pub reference: ReferenceChoice,
}

/// What is common to all of a study.
#[derive(Debug)]
pub struct Plan {
    /// Where everything is kept.
    pub folder: PathBuf,
    /// Name of the scene, for titles.
    pub scene: String,
    /// What must be the same for all that is kept in one folder, as named texts.
    pub identity: Vec<(&'static str, String)>,
    /// In increasing order, at least one.
    pub amounts: Vec<Amount>,
    /// At least 3: fewer say nothing of intervals.
    pub runs: usize,
    pub base_seed: u64,
    /// Relative errors that are wanted: what they take is forecast.
    pub wanted: Vec<f64>,
    pub threads: usize,
    /// The command, for the report.
    pub command_line: String,
}

impl Plan {
    /// Seed of a run: its own for each amount and number, so that all runs are independent of each other,
    /// and the same for all methods. Below 2^53, so that programs that know no 64-bit integers read it right.
    pub fn seed(&self, amount: Amount, run: usize) -> u64 {
        mix(mix(mix(self.base_seed) ^ amount.number()) ^ run as u64) >> 11
    }

    /// Seed of the part of a reference that begins with sample number `first`.
    pub fn reference_seed(&self, first: u64) -> u64 {
        // Complemented, where no run's number of samples lies.
        mix(mix(mix(self.base_seed) ^ !first) ^ u64::MAX) >> 11
    }

    /// Name of the file of a run within the folder. It holds a hash of all that determines the run, so that what
    /// was made under other settings is never taken for it.
    pub fn run_file(&self, method: &Method, amount: Amount, run: usize) -> PathBuf {
        let hash = self.run_hash(method, amount, run);
        let name = format!(
            "{}-{}-{:03}-{hash}.exr",
            slug(&method.label),
            amount.slug(),
            run + 1
        );
        self.folder.join("runs").join(name)
    }

    /// Hash of all that determines a run, its time on the clock included.
    pub fn run_hash(&self, method: &Method, amount: Amount, run: usize) -> String {
        let seed = self.seed(amount, run);
        let threads = self.threads;
        hash(&format!(
            "{}|{amount}|seed {seed}|threads {threads}",
            method.settings
        ))
    }

    /// Names of the pictures of a setting start so.
    pub fn picture_stem(&self, method: &Method, amount: Amount) -> String {
        format!("{}-{}", slug(&method.label), amount.slug())
    }

    /// The identity as it is kept in the folder.
    pub fn identity_json(&self) -> Value {
        let pairs = self.identity.iter();
        let fields = pairs.map(|(name, text)| (name.to_string(), json!(text)));
        json!({ "luxel_study": FORMAT, "of": Value::Object(fields.collect()) })
    }
}

/// Version of the files in the folder.
pub const FORMAT: u32 = 1;

/// Why a study ended without its results.
#[derive(Clone, Debug, PartialEq)]
pub enum StudyError {
    /// The scene, the reference or the folder is wrong.
    Input(String),
    /// A file could not be written.
    Output(String),
}

impl fmt::Display for StudyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            StudyError::Input(what) | StudyError::Output(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for StudyError {}

impl From<ImageError> for StudyError {
    fn from(e: ImageError) -> StudyError {
        match e {
            ImageError::Read { .. } => StudyError::Input(e.to_string()),
            ImageError::Write { .. } => StudyError::Output(e.to_string()),
        }
    }
}

/// FNV-1a over the text, 16 hexadecimal digits: the same with every version of the compiler.
pub fn hash(text: &str) -> String {
    let step = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let h = text.bytes().fold(0xcbf2_9ce4_8422_2325, step);
    format!("{h:016x}")
}

/// The label as part of a name of a file: letters, digits, `.`, `_` and `-`.
pub fn slug(label: &str) -> String {
    let safe = |c: char| match c {
        c if c.is_ascii_alphanumeric() || "._-".contains(c) => c,
        '=' => '-',
        _ => '_',
    };
    // Long labels are told apart by the hash behind them.
    label.chars().map(safe).take(80).collect()
}
