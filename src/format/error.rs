//! Errors that name file, line and column, and the map from byte offsets back to them.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The first thing that is wrong with a scene, where it is, and what may help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    pub at: Place,
    pub what: String,
    pub help: Option<String>,
}

/// A position in a text file, with the line for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    pub file: PathBuf,
    /// From 1; 0 when the file as a whole is meant.
    pub line: u32,
    /// In characters, from 1.
    pub column: u32,
    /// That line; empty when there is none to show.
    pub text: String,
}

impl SceneError {
    pub fn new(at: Place, what: impl Into<String>) -> SceneError {
        SceneError {
            at,
            what: what.into(),
            help: None,
        }
    }

    pub fn with_help(mut self, help: impl Into<String>) -> SceneError {
        self.help = Some(help.into());
        self
    }

    /// Adds a help line when there is something to say.
    pub fn with_help_opt(self, help: Option<String>) -> SceneError {
        match help {
            Some(help) => self.with_help(help),
            None => self,
        }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.what)?;
        let Place { column, text, .. } = &self.at;
        if !text.is_empty() {
            let caret = format!("{:>1$}", '^', *column as usize);
            write!(f, "\n  {text}\n  {caret}")?;
        }
        self.help
            .iter()
            .try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

impl std::error::Error for SceneError {}

/// `file:line:column`, or the file alone where it is meant as a whole.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.file.display()),
            line => write!(f, "{}:{line}:{}", self.file.display(), self.column),
        }
    }
}

/// A place inside one of the sources of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub source: u32,
    pub offset: u32,
}

/// A text that was read, kept for its error messages.
#[derive(Clone, Debug)]
pub struct Source {
    pub name: PathBuf,
    pub text: Arc<str>,
}

/// Lines longer than this are not shown: a caret far to the right helps nobody.
const SHOWN_COLUMNS: usize = 240;

impl Source {
    /// Line, column and text of the line around a byte offset; any offset is allowed.
    pub fn place(&self, offset: usize) -> Place {
        let mut offset = offset.min(self.text.len());
        while !self.text.is_char_boundary(offset) {
            offset -= 1;
        }
        let start = self.text[..offset].rfind('\n').map_or(0, |i| i + 1);
        let end = self.text[offset..]
            .find('\n')
            .map_or(self.text.len(), |i| offset + i);
        let line = 1 + self.text[..start].matches('\n').count();
        let column = 1 + self.text[start..offset].chars().count();
        Place {
            file: self.name.clone(),
            line: line as u32,
            column: column as u32,
            text: shown_line(&self.text[start..end], column),
        }
    }

    /// The place of a line and a column that a parser reported, both from 1.
    pub fn place_at(&self, line: u32, column: u32) -> Place {
        let text = self.text.lines().nth((line.max(1) - 1) as usize);
        Place {
            file: self.name.clone(),
            line: line.max(1),
            column: column.max(1),
            text: shown_line(text.unwrap_or(""), column as usize),
        }
    }
}

/// The line with one character per column, so that the caret stands below its target.
fn shown_line(line: &str, column: usize) -> String {
    if column > SHOWN_COLUMNS {
        return String::new();
    }
    line.trim_end()
        .chars()
        .take(SHOWN_COLUMNS)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// The place of a whole file, for errors about the file rather than its text.
pub fn whole_file(file: &Path) -> Place {
    Place {
        file: file.to_path_buf(),
        line: 0,
        column: 0,
        text: String::new(),
    }
}

/// The place of the value of an option of the command line, such as `-D` or `--aov`.
pub fn command_line(option: &str, value: &str) -> Place {
    let column = option.chars().count() + 2;
    Place {
        file: "command line".into(),
        line: 1,
        column: column as u32,
        text: shown_line(&format!("{option} {value}"), column),
    }
}

/// A help line with the candidate most like `found`, if one is close enough to be a slip.
pub fn did_you_mean<'a>(
    found: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    // A long input is no slip, and would make the distance costly.
    if found.len() > 64 {
        return None;
    }
    let allowed = 1 + found.chars().count() / 4;
    candidates
        .into_iter()
        .map(|candidate| (edit_distance(found, candidate), candidate))
        .filter(|&(distance, _)| distance <= allowed)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| format!("did you mean \"{candidate}\"?"))
}

/// Number of insertions, deletions, substitutions and swaps of neighbours between two words, case
/// ignored (optimal string alignment, Damerau 1964).
fn edit_distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().map(|c| c.to_ascii_lowercase()).collect();
    let b: Vec<char> = b.chars().map(|c| c.to_ascii_lowercase()).collect();
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let cost = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (last[j] + 1).min(row[j - 1] + 1).min(last[j - 1] + cost);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

/// A number as a reader would write it, also when it is very large or small.
pub fn shown_number(x: f64) -> String {
    match x.abs() {
        1e-5..1e9 | 0.0 => x.to_string(),
        _ => format!("{x:e}"),
    }
}

/// `"a", "b" and "c"`, for lists in messages.
pub fn list(names: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let mut names: Vec<String> = names
        .into_iter()
        .map(|n| format!("\"{}\"", n.as_ref()))
        .collect();
    match names.pop() {
        None => "none".into(),
        Some(last) if names.is_empty() => last,
        Some(last) => format!("{} and {last}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_characters_from_one() {
        let source = Source {
            name: "a.xml".into(),
            text: "ä\tb\r\n\ncd".into(),
        };
        let place = source.place(3);
        assert_eq!((place.line, place.column), (1, 3));
        assert_eq!(place.text, "ä b");
        assert_eq!(source.place(6).line, 2);
        assert_eq!(
            (source.place(99).line, source.place(99).text),
            (3, "cd".into())
        );
        // Inside a character of two bytes.
        assert_eq!(source.place(1).column, 1);
    }

    #[test]
    fn slips_are_recognised_and_other_words_are_not() {
        assert_eq!(edit_distance("refletance", "reflectance"), 1);
        assert_eq!(edit_distance("raidus", "radius"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
        let known = ["radius", "center", "to_world"];
        assert_eq!(
            did_you_mean("toWorld", known),
            Some("did you mean \"to_world\"?".into())
        );
        assert_eq!(did_you_mean("reflectance", known), None);
        assert_eq!(list(["a"]), "\"a\"");
        assert_eq!(list(["a", "b", "c"]), "\"a\", \"b\" and \"c\"");
    }
}
