//! From XML files to a checked [`SceneDesc`]: elements, includes, references.
//!
//! The language is that of Mitsuba 3 (versions 2 and 3 of the format, 0.x after [`upgrade`]).

mod attributes;
mod elements;
mod loader;
mod parameters;
mod resolve;
mod upgrade;
mod values;

pub(super) use loader::Loader;
pub(super) use parameters::Parameters;
pub(super) use values::floats;

use super::error::{SceneError, Source, did_you_mean, whole_file};
use super::limits;
use roxmltree::{Document, ParsingOptions};
use std::io::Read;
use std::path::Path;

/// Reads a text file of limited size.
pub(super) fn read_text(path: &Path) -> Result<String, String> {
    let failed = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".to_string(),
        _ => format!("cannot read it: {error}"),
    };
    let file = std::fs::File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    file.take(limits::XML_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    if bytes.len() as u64 > limits::XML_FILE_BYTES {
        return Err(format!(
            "it is larger than {} MiB",
            limits::XML_FILE_BYTES >> 20
        ));
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid]
            .iter()
            .filter(|&&b| b == b'\n')
            .count();
        format!("line {line} is not UTF-8")
    })
}

/// The XML tree of a source, with document types refused.
pub(super) fn parse(source: &Source) -> Result<Document<'_>, SceneError> {
    check_nesting(source)?;
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: limits::XML_NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(&source.text, options).map_err(|error| match error {
        roxmltree::Error::DtdDetected => {
            let at = source.text.find("<!DOCTYPE").unwrap_or(0);
            SceneError::new(source.place(at), "a document type is not allowed")
                .with_help("remove <!DOCTYPE ...>; for values use <default> and $name")
        }
        roxmltree::Error::NodesLimitReached => SceneError::new(
            whole_file(&source.name),
            format!("more than {} XML nodes", limits::XML_NODES),
        ),
        error => {
            let at = error.pos();
            // The position is told by the place.
            let what = error.to_string().replacen(&format!(" at {at}"), "", 1);
            SceneError::new(source.place_at(at.row, at.col), format!("not XML: {what}"))
        }
    })
}

/// Refuses deep nesting before the parser and the walk meet it. Counts tags only roughly (comments
/// and attribute values may fool it by a few), so it stops well above what scenes need.
fn check_nesting(source: &Source) -> Result<(), SceneError> {
    let text = source.text.as_bytes();
    let (mut depth, mut i) = (0usize, 0);
    while let Some(open) = source.text[i..].find('<').map(|k| i + k) {
        let rest = &source.text[open..];
        let end = |mark: &str| {
            rest.find(mark)
                .map_or(text.len(), |k| open + k + mark.len())
        };
        i = if rest.starts_with("<!--") {
            end("-->")
        } else if rest.starts_with("<![CDATA[") {
            end("]]>")
        } else if rest.starts_with("<?") || rest.starts_with("<!") {
            end(">")
        } else {
            let close = tag_end(text, open);
            let empty = text.get(close.wrapping_sub(2)) == Some(&b'/');
            if rest.starts_with("</") {
                depth = depth.saturating_sub(1);
            } else if !empty {
                depth += 1;
            }
            close
        };
        if depth > limits::XML_NESTING {
            let what = format!("elements nested more than {} deep", limits::XML_NESTING);
            return Err(SceneError::new(source.place(open), what));
        }
    }
    Ok(())
}

/// The byte after the `>` that ends a tag, quotes respected.
fn tag_end(text: &[u8], open: usize) -> usize {
    let mut quote = None;
    for (k, &byte) in text.iter().enumerate().skip(open) {
        match (quote, byte) {
            (None, b'>') => return k + 1,
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(q), b) if q == b => quote = None,
            _ => {}
        }
    }
    text.len()
}

/// Help for a word that is not among the known ones.
fn help_among<'a>(
    found: &str,
    known: impl IntoIterator<Item = &'a str> + Clone,
    otherwise: &str,
) -> String {
    did_you_mean(found, known.clone())
        .unwrap_or_else(|| format!("{otherwise} {}", super::error::list(known)))
}
