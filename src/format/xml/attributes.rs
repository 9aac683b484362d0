//! Attributes with their parameters filled in, checks of what an element may carry, and the search
//! for files.

use super::super::desc::place;
use super::super::error::{Place, SceneError, Span, did_you_mean, list};
use super::super::plugins::Category;
use super::loader::{File, Loader};
use super::values::Wrong;
use super::{help_among, upgrade, values};
use roxmltree::Node;
use std::path::{Path, PathBuf};

/// An attribute with its parameters filled in.
pub(super) struct Attribute {
    pub text: String,
    pub at: Span,
}

pub(super) const VALUE_TAGS: [&str; 10] = [
    "integer",
    "float",
    "boolean",
    "string",
    "rgb",
    "spectrum",
    "point",
    "vector",
    "transform",
    "animation",
];
const OTHER_TAGS: [&str; 5] = ["default", "include", "path", "alias", "ref"];
pub(super) const STEP_TAGS: [&str; 5] = ["translate", "scale", "rotate", "lookat", "matrix"];

impl Loader {
    /// Places where a file may be, the best first.
    pub(super) fn candidates<'a>(
        &'a self,
        name: &'a str,
        folder: &'a Path,
    ) -> impl Iterator<Item = PathBuf> {
        std::iter::once(folder)
            .chain(self.folders.iter().map(PathBuf::as_path))
            .map(move |folder| folder.join(name))
    }

    pub(super) fn find_file(&self, name: &str, folder: &Path) -> Result<PathBuf, Wrong> {
        if name.is_empty() {
            return Err(("the name of the file is empty".into(), None));
        }
        let found = self.candidates(name, folder).find(|path| path.is_file());
        found.ok_or_else(|| {
            let mut folders: Vec<String> = Vec::new();
            for folder in self.candidates("", folder) {
                let shown = match folder.as_os_str().is_empty() {
                    true => ".".to_string(),
                    false => folder.display().to_string(),
                };
                let shown = match shown.trim_end_matches('/') {
                    "" => shown,
                    trimmed => trimmed.to_string(),
                };
                if !folders.contains(&shown) {
                    folders.push(shown);
                }
            }
            let help = format!("looked in {}", list(folders));
            (format!("no file \"{name}\""), Some(help))
        })
    }

    pub(super) fn attribute(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        name: &str,
    ) -> Result<Option<Attribute>, SceneError> {
        let Some(attribute) = node.attribute_node(name) else {
            return Ok(None);
        };
        let at = span(file.index, attribute.range().start);
        match self.parameters.fill_in(attribute.value()) {
            Ok(text) => Ok(Some(Attribute { text, at })),
            Err((what, help)) => Err(self.error(at, what).with_help(help)),
        }
    }

    pub(super) fn required(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        name: &str,
    ) -> Result<Attribute, SceneError> {
        match self.attribute(file, node, name)? {
            Some(attribute) => Ok(attribute),
            None => Err(self.missing(file, node, name)),
        }
    }

    pub(super) fn missing(&self, file: File<'_>, node: Node<'_, '_>, name: &str) -> SceneError {
        let what = format!("<{}> has no attribute \"{name}\"", node.tag_name().name());
        self.error(tag_span(file.index, node), what)
    }

    pub(super) fn check_attributes(
        &self,
        file: File<'_>,
        node: Node<'_, '_>,
        known: &[&str],
    ) -> Result<(), SceneError> {
        let mut attributes = node.attributes();
        let Some(unknown) = attributes.find(|a| !known.contains(&a.name())) else {
            return Ok(());
        };
        let what = format!(
            "unknown attribute \"{}\" of <{}>",
            unknown.name(),
            node.tag_name().name()
        );
        let help = help_among(unknown.name(), known.iter().copied(), "allowed are");
        let at = span(file.index, unknown.range().start);
        Err(self.error(at, what).with_help(help))
    }

    /// An element with nothing inside.
    pub(super) fn leaf(
        &self,
        file: File<'_>,
        node: Node<'_, '_>,
        known: &[&str],
    ) -> Result<(), SceneError> {
        self.check_attributes(file, node, known)?;
        for child in node.children() {
            if child.is_text() {
                self.check_text(file, child)?;
            }
            if child.is_element() {
                let (inner, outer) = (child.tag_name().name(), node.tag_name().name());
                let what = format!("<{inner}> cannot stand inside <{outer}>");
                return Err(self.error(tag_span(file.index, child), what));
            }
        }
        Ok(())
    }

    pub(super) fn check_text(&self, file: File<'_>, node: Node<'_, '_>) -> Result<(), SceneError> {
        let text = node.text().unwrap_or_default();
        let trimmed = text.trim_start();
        if trimmed.is_empty() {
            return Ok(());
        }
        let start = node.range().start + (text.len() - trimmed.len());
        let what = format!(
            "text outside of tags: {}",
            values::quoted(trimmed.trim_end())
        );
        Err(self.error(span(file.index, start), what))
    }

    pub(super) fn unknown_tag(&self, file: File<'_>, node: Node<'_, '_>) -> SceneError {
        let tag = node.tag_name().name();
        let objects = Category::ALL.into_iter().map(Category::tag);
        let known = objects.chain(VALUE_TAGS).chain(OTHER_TAGS);
        let help = match tag {
            "scene" => Some("a <scene> can only be the root of a file".into()),
            _ if STEP_TAGS.contains(&tag) => Some(format!("<{tag}> stands inside <transform>")),
            _ => did_you_mean(tag, known),
        };
        self.error(
            tag_span(file.index, node),
            format!("unknown element <{tag}>"),
        )
        .with_help_opt(help)
    }

    pub(super) fn wrong(&self, at: Span, (what, help): values::Wrong) -> SceneError {
        self.error(at, what).with_help_opt(help)
    }

    pub(super) fn error(&self, at: Span, what: impl Into<String>) -> SceneError {
        SceneError::new(self.place(at), what)
    }

    pub(super) fn place(&self, at: Span) -> Place {
        place(&self.sources, at)
    }
}

pub(super) fn current_name(file: File<'_>, name: String) -> String {
    match file.old {
        true => upgrade::snake_case(&name),
        false => name,
    }
}

pub(super) fn span(source: u32, offset: usize) -> Span {
    // Files are limited to far less than 4 GiB.
    Span {
        source,
        offset: u32::try_from(offset).unwrap_or(u32::MAX),
    }
}

pub(super) fn tag_span(source: u32, node: Node<'_, '_>) -> Span {
    span(source, node.range().start)
}
