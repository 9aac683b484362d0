//! `luxel merge`.

use std::path::PathBuf;

use clap::Args;

use super::told;
use super::{Failure, Outcome};
use crate::image_io::Image;
use crate::render::{Metadata, Saved, merge};

#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Files that `luxel render --shard I/N` wrote, all N of them
    #[arg(required = true)]
    pub shards: Vec<PathBuf>,
    /// Image to write: .exr (all layers), .png, .jpg, .hdr or .pfm; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
}

pub fn run(args: &MergeArgs, command_line: &str) -> Result<Outcome, Failure> {
    if let Some(unknown) = args.output.iter().find(|p| !Image::can_write_extension(p)) {
        let what = format!(
            "-o {}: the extension is not .exr, .png, .jpg, .hdr or .pfm",
            unknown.display()
        );
        return Err(Failure::Usage(what));
    }
    let same = |a: &PathBuf, b: &PathBuf| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    if let Some(shard) = (args.shards.iter()).find(|s| args.output.iter().any(|o| same(o, s))) {
        let what = format!(
            "-o {}: this would replace one of the shards: choose another name",
            shard.display()
        );
        return Err(Failure::Usage(what));
    }
    args.output.iter().try_for_each(Image::check_target)?;
    let read = |path: &PathBuf| {
        let name = path.display().to_string();
        match Saved::read(path) {
            Ok(saved) => Ok((name, saved)),
            Err(what) => Err(Failure::Input(format!("cannot join {name}: {what}"))),
        }
    };
    let shards = args
        .shards
        .iter()
        .map(read)
        .collect::<Result<Vec<_>, _>>()?;
    let whole = merge(shards).map_err(Failure::Input)?;
    let metadata = Metadata {
        command_line: command_line.to_string(),
        ..whole.metadata
    };
    let image = whole.recipe.picture(&whole.film, &whole.stats, &metadata);
    told::write_all(&image, &args.output)?;
    eprintln!("{}", told::summary(&whole.film, &whole.stats, &args.output));
    told::report_invalid(&whole.stats);
    Ok(Outcome::Done)
}
