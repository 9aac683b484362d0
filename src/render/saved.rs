//! What was done of a picture so far, in a file: to go on from there, or to be joined with other parts.
//!
//! The file is an EXR: the picture so far, which any viewer shows, and a layer `state` with the film to the last bit.
//! What determines the picture stands in it too, so that only what belongs together is joined.

use std::collections::BTreeSet;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Job, Metadata, Recipe, Shard, Stats, Stop, Work};
use crate::film::{Film, Planes, Taken, Window};
use crate::image_io::{Channel, Image, Layer, Samples};
use crate::transport::{Indirect, IntegratorSpec};

/// Name of the layer that holds the film.
const STATE: &str = "state";
/// Of the way that all this is written.
const FORMAT: u64 = 2;

/// All that determines a picture, in words that can be compared and shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// In the order in which differences are told.
    settings: Vec<(String, String)>,
}

impl Identity {
    /// `scene_hash` is that of the description and of the files that it names.
    pub fn new(job: &Job, stop: Stop, scene_hash: &str) -> Identity {
        let until = match stop {
            Stop::Spp(n) => format!("{n} samples per pixel"),
            Stop::Time(_) => "a time".to_string(),
            Stop::Error { target, .. } => {
                let pixels = target
                    .quantile
                    .map(|q| format!(" in {} % of the pixels", 100.0 * q));
                format!(
                    "an error of {} %{}",
                    100.0 * target.error,
                    pixels.unwrap_or_default()
                )
            }
        };
        let crop = &job.film.crop;
        let settings = [
            ("version of luxel", env!("CARGO_PKG_VERSION").to_string()),
            ("scene", scene_hash.to_string()),
            (
                "resolution",
                format!("{}x{}", job.film.width, job.film.height),
            ),
            (
                "crop",
                format!("{},{},{},{}", crop.x, crop.y, crop.width, crop.height),
            ),
            (
                "film",
                format!(
                    "{:?} {:?} {:?}",
                    job.film.filter, job.pixel_format, job.component_format
                ),
            ),
            ("sampler", job.sampler.name().to_string()),
            ("seed", job.seed.to_string()),
            ("integrator", label(&job.integrator)),
            // A solution that is known already changes nothing.
            (
                "settings of the integrator",
                format!("{:?}", job.integrator.clone().with_solution(None)),
            ),
            ("layers", format!("{:?}", job.aovs)),
            ("end", until),
        ];
        Identity {
            settings: settings
                .map(|(name, value)| (name.to_string(), value))
                .into(),
        }
    }

    /// What differs, in words; `None` if nothing does.
    pub fn difference(&self, other: &Identity) -> Option<String> {
        let differs = |(a, b): &(&(String, String), &(String, String))| a != b;
        let (a, b) = self.settings.iter().zip(&other.settings).find(differs)?;
        Some(match a.0.as_str() {
            "scene" => "the scene, or a file that it names, is another".to_string(),
            // These are compared by what the program knows of them, which is nothing to read.
            "film" => "filter or format of the film are others".to_string(),
            name @ ("settings of the integrator" | "layers") => format!("the {name} are others"),
            name => format!("{name}: {} there, {} here", b.1, a.1),
        })
    }
}

/// What an integrator is called, with the use that it makes of radiosity.
fn label(integrator: &IntegratorSpec) -> String {
    let name = integrator.name();
    match integrator.cache().map(|cache| cache.indirect) {
        None | Some(Indirect::None) => name.to_string(),
        Some(indirect) => format!("{name} --indirect {}", indirect.name()),
    }
}

/// A part of a picture.
#[derive(Debug)]
pub struct Saved {
    pub identity: Identity,
    pub recipe: Recipe,
    pub metadata: Metadata,
    pub shard: Option<Shard>,
    /// Samples per pixel of the whole picture, where they are known.
    pub planned: Option<u64>,
    pub film: Film,
    pub stats: Stats,
}

/// The metadata of the file, beside those of the picture.
#[derive(Serialize, Deserialize)]
struct Head {
    format: u64,
    identity: Identity,
    recipe: Recipe,
    metadata: Metadata,
    shard: Option<Shard>,
    planned: Option<u64>,
    window: [u32; 4],
    replicates: u32,
    aov_channels: usize,
    parts: usize,
    /// First sample and the one behind the last; `None` where tiles differ.
    samples: Option<[u64; 2]>,
    goal: u64,
    /// Of all planes of the film.
    checksum: String,
    stats: Stats,
}

impl Job {
    /// The file that a part of the picture is kept in.
    pub fn to_be_saved(
        &self,
        identity: &Identity,
        work: &Work,
        film: &Film,
        stats: &Stats,
        metadata: &Metadata,
    ) -> Image {
        let recipe = self.recipe();
        let mut image = recipe.picture(film, stats, metadata);
        let window = film.window();
        let planes = film.planes();
        let head = Head {
            format: FORMAT,
            identity: identity.clone(),
            metadata: metadata.clone(),
            shard: work.shard,
            planned: work.stop.spp(),
            window: [window.x, window.y, window.width, window.height],
            replicates: film.replicates(),
            aov_channels: self.aovs.iter().map(|l| l.aov.channels().len()).sum(),
            parts: film.parts(),
            samples: film.range().map(|r| [r.start, r.end]),
            goal: film.goal(),
            checksum: checksum(&planes),
            stats: stats.clone(),
            recipe,
        };
        let mut told: Value = match &image.metadata {
            Some(text) => serde_json::from_str(text).unwrap_or(json!({})),
            None => json!({}),
        };
        told[STATE] = json!(head);
        image.metadata = Some(told.to_string());
        let channel = |(name, plane)| Channel {
            name,
            samples: Samples::Bits(plane),
        };
        image.layers.push(Layer {
            name: STATE.to_string(),
            channels: planes.0.into_iter().map(channel).collect(),
        });
        image
    }
}

impl Saved {
    /// Whether there is a checkpoint or a shard, as far as its head tells.
    pub fn is_one(path: &Path) -> bool {
        let image = path.exists().then(|| Image::read(path).ok()).flatten();
        let told = image.and_then(|image| image.metadata);
        let told = told.and_then(|text| serde_json::from_str::<Value>(&text).ok());
        told.is_some_and(|told| told.get(STATE).is_some())
    }

    /// # Errors
    /// In words, without the name of the file: it cannot be read, is no part of a picture or of another version, or is
    /// not complete.
    pub fn read(path: &Path) -> Result<Saved, String> {
        let image = Image::read(path).map_err(|e| e.to_string())?;
        let told: Option<Value> =
            (image.metadata.as_ref()).and_then(|t| serde_json::from_str(t).ok());
        let Some(head) = told.as_ref().and_then(|told| told.get(STATE)) else {
            return Err(
                "it is a picture, but neither a checkpoint nor a shard: what was summed is not in it".to_string()
            );
        };
        if head["format"] != json!(FORMAT) {
            return Err("it was written by another version of luxel".to_string());
        }
        let head: Head = serde_json::from_value(head.clone())
            .map_err(|e| format!("what is told of its making is malformed: {e}"))?;
        let [x, y, width, height] = head.window;
        let window = Window {
            x,
            y,
            width,
            height,
        };
        let fits = [image.width, image.height] == [width as usize, height as usize]
            && head.replicates.is_power_of_two()
            && head.replicates <= 16
            && (head.samples.is_some() || head.replicates >= 4);
        if !fits || head.samples.is_some_and(|[a, b]| a > b) {
            return Err("what is told of its making is malformed".to_string());
        }
        let mut film = match head.samples {
            Some([first, _]) => {
                let film = Film::new(window, head.replicates, head.aov_channels);
                film.from_sample(first)
            }
            None => Film::adaptive(window, head.replicates, head.aov_channels),
        };
        film = film.with_parts(head.parts);
        let [first, end] = head.samples.unwrap_or_default();
        let planes = planes(image);
        if checksum(&planes) != head.checksum {
            return Err("it is damaged: what was summed is not what was written".to_string());
        }
        film.add_planes(&planes, &Taken::Range(first..end))
            .map_err(|e| e.to_string())?;
        if head.samples.is_some() {
            let goal = [head.goal; 2];
            film.tiles_mut()
                .iter_mut()
                .for_each(|tile| tile.set_goal(goal));
        }
        Ok(Saved {
            identity: head.identity,
            recipe: head.recipe,
            metadata: head.metadata,
            shard: head.shard,
            planned: head.planned,
            film,
            stats: head.stats,
        })
    }

    /// Whether it is a shard of which all samples were taken; shards of pictures that end otherwise do not exist.
    pub fn is_complete(&self) -> bool {
        let whole = self
            .shard
            .zip(self.planned)
            .map(|(shard, spp)| shard.range(spp));
        whole.is_some() && self.film.range() == whole
    }
}

/// Of names and numbers, in whatever order the planes are (the sum of their FNV-1a hashes of 64 bits, by words; Fowler,
/// Noll & Vo 1991): any bit that flips changes it.
fn checksum(planes: &Planes) -> String {
    const BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x100_0000_01b3;
    let step = |hash: u64, word: u32| (hash ^ u64::from(word)).wrapping_mul(PRIME);
    let of = |(name, plane): &(String, Vec<u32>)| {
        let name = name.bytes().map(u32::from);
        name.chain(plane.iter().copied()).fold(BASIS, step)
    };
    let sum = planes.0.iter().map(of).fold(0, u64::wrapping_add);
    format!("{sum:016x}")
}

fn planes(image: Image) -> Planes {
    let layer = image.layers.into_iter().find(|layer| layer.name == STATE);
    let plane = |channel: Channel| match channel.samples {
        Samples::Uint(plane) | Samples::Bits(plane) => Some((channel.name, plane)),
        _ => None,
    };
    let channels = layer.map_or(Vec::new(), |layer| layer.channels);
    Planes(channels.into_iter().filter_map(plane).collect())
}

/// `2/8, 5/8 and 3 more`: those of the numbers up to `of` that are not in `there`.
fn missing(there: &BTreeSet<u64>, of: u64) -> String {
    /// More need not be named.
    const SHOWN: usize = 20;
    let absent = (1..=of).filter(|n| !there.contains(n));
    let shown: Vec<String> = absent.take(SHOWN).map(|n| format!("{n}/{of}")).collect();
    let more = (of - there.len() as u64).saturating_sub(SHOWN as u64);
    match more {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// The whole picture's film and statistics, of its shards in any order: the same film bit for bit as if it had been
/// rendered at once.
///
/// # Errors
/// In words: parts that do not belong together, are not complete, are there twice, or are missing. `shards` come with
/// the names that they are told by.
pub fn merge(mut shards: Vec<(String, Saved)>) -> Result<Saved, String> {
    let Some((first, of, planned)) = shards
        .first()
        .and_then(|(name, saved)| Some((name.clone(), saved.shard?.of, saved.planned?)))
    else {
        return Err(match shards.first() {
            Some((name, _)) => {
                format!("{name} is a checkpoint, not a shard: go on with it by --resume")
            }
            None => "there are no shards".to_string(),
        });
    };
    for (name, saved) in &shards {
        let Some(shard) = saved.shard else {
            return Err(format!(
                "{name} is a checkpoint, not a shard: go on with it by --resume"
            ));
        };
        if let Some(what) = shards[0].1.identity.difference(&saved.identity) {
            return Err(format!("{name} does not belong to {first}: {what}"));
        }
        if shard.of != of {
            return Err(format!(
                "{name} is one of {} shards, {first} one of {of}: they do not belong together",
                shard.of
            ));
        }
    }
    let number = |saved: &Saved| saved.shard.map_or(0, |shard| shard.number);
    // A checkpoint may lie beside a shard that was completed since.
    let complete: BTreeSet<u64> = (shards.iter())
        .filter(|(_, saved)| saved.is_complete())
        .map(|(_, saved)| number(saved))
        .collect();
    shards.retain(|(_, saved)| saved.is_complete() || !complete.contains(&number(saved)));
    if let Some((name, saved)) = shards.iter().find(|(_, saved)| !saved.is_complete()) {
        let others = match of - complete.len() as u64 {
            1 => String::new(),
            n => format!(
                "; with it, {n} of {of} shards are missing or not complete: {}",
                missing(&complete, of)
            ),
        };
        return Err(format!(
            "{name} is not complete: {} of its samples per pixel are there; go on with it by --shard {}/{of} --resume{others}",
            saved.film.spp(),
            number(saved)
        ));
    }
    shards.sort_by_key(|(_, saved)| saved.shard.map(|shard| shard.number));
    if let Some(twice) = shards
        .windows(2)
        .find(|w| number(&w[0].1) == number(&w[1].1))
    {
        return Err(format!(
            "{} and {} are the same shard, {} of {of}",
            twice[0].0,
            twice[1].0,
            number(&twice[0].1)
        ));
    }
    if (complete.len() as u64) < of {
        return Err(format!("shards are missing: {}", missing(&complete, of)));
    }
    let mut parts = shards.into_iter().map(|(_, saved)| saved);
    let Some(mut whole) = parts.next() else {
        return Err("there are no shards".to_string());
    };
    for part in parts {
        let range = part.film.range().unwrap_or(0..0);
        let added = whole
            .film
            .add_planes(&part.film.planes(), &Taken::Range(range));
        added.map_err(|e| e.to_string())?;
        let seconds = whole.stats.seconds + part.stats.seconds;
        whole.stats.add(part.stats);
        whole.stats.seconds = seconds;
    }
    whole.shard = None;
    whole.planned = Some(planned);
    Ok(whole)
}
