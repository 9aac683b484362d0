//! The walk over the elements of a scene and of the files it includes.

use super::super::check;
use super::super::desc::{Given, Mark, Object, ObjectId, SceneDesc, place};
use super::super::error::{SceneError, Source, Span, did_you_mean};
use super::super::limits;
use super::super::plugins::{self, Category};
use super::attributes::{Attribute, VALUE_TAGS, current_name, span, tag_span};
use super::resolve::{self, Ids, RawChild, Target};
use super::{Parameters, parse, read_text, upgrade, values};
use roxmltree::Node;
use std::path::{Path, PathBuf};

/// Everything gathered while the files are read.
pub struct Loader {
    pub(super) sources: Vec<Source>,
    pub(super) parameters: Parameters,
    objects: Vec<Object>,
    /// Children of the objects, as met.
    children: Vec<Vec<RawChild>>,
    ids: Ids,
    /// Folder of the scene, then those of `<path>`.
    pub(super) folders: Vec<PathBuf>,
    bytes: u64,
}

/// The file whose elements are walked.
#[derive(Clone, Copy)]
pub(super) struct File<'a> {
    pub index: u32,
    /// Includes around it.
    pub depth: usize,
    pub folder: &'a Path,
    /// Before version 2: names are upgraded.
    pub old: bool,
}

impl Loader {
    pub fn new(parameters: Parameters, folder: PathBuf) -> Loader {
        Loader {
            sources: Vec::new(),
            parameters,
            objects: Vec::new(),
            children: Vec::new(),
            ids: Ids::new(),
            folders: vec![folder],
            bytes: 0,
        }
    }

    /// Reads the scene and all that it includes.
    pub fn load(
        mut self,
        source: Source,
        defines: &[(String, String)],
    ) -> Result<SceneDesc, SceneError> {
        let folder = self.folders[0].clone();
        let root = self.document(source, &folder, 0, None)?;
        self.parameters.check_used(defines)?;
        let Loader {
            sources,
            mut objects,
            children,
            ids,
            ..
        } = self;
        resolve::references(&mut objects, children, &ids, &sources)?;
        resolve::check_depth(&objects, &sources)?;
        let find_place = |at: Span| place(&sources, at);
        for object in &objects {
            check::children(&objects, object, &find_place)?;
        }
        Ok(SceneDesc {
            sources,
            objects,
            root,
        })
    }

    /// One file: a scene, or for an include whatever it holds, put into `parent`.
    fn document(
        &mut self,
        source: Source,
        folder: &Path,
        depth: usize,
        parent: Option<ObjectId>,
    ) -> Result<ObjectId, SceneError> {
        let index = self.sources.len() as u32;
        self.bytes += source.text.len() as u64;
        // The tree borrows its text, while the walk adds sources.
        let held = source.clone();
        self.sources.push(source);
        let document = parse(&held)?;
        let root = document.root_element();
        let at = tag_span(index, root);
        let version = root.attribute_node("version").ok_or_else(|| {
            let what = format!("<{}> has no attribute \"version\"", root.tag_name().name());
            self.error(at, what)
                .with_help("write <scene version=\"3.0.0\">")
        })?;
        let version_at = span(index, version.range().start);
        let major = major_version(version.value()).ok_or_else(|| {
            let what = format!("{} is no version", values::quoted(version.value()));
            self.error(version_at, what)
                .with_help("write three numbers, such as \"3.0.0\"")
        })?;
        if major > 3 {
            let what = format!(
                "version {} is newer than luxel knows",
                values::quoted(version.value())
            );
            return Err(self.error(version_at, what));
        }
        let file = File {
            index,
            depth,
            folder,
            old: major < 2,
        };
        let is_scene = root.tag_name().name() == "scene";
        let owner = match (parent, is_scene) {
            (Some(parent), true) => {
                self.check_attributes(file, root, &["version"])?;
                parent
            }
            (Some(parent), false) => {
                self.object(file, root, parent)?;
                return Ok(parent);
            }
            (None, true) => {
                self.check_attributes(file, root, &["version"])?;
                self.add(plugins::scene(), None, at)
            }
            (None, false) => {
                let what = format!("the root is <{}>, not <scene>", root.tag_name().name());
                return Err(self.error(at, what));
            }
        };
        let mut params = Vec::new();
        self.content(file, root, owner, &mut params)?;
        if let Some(param) = params.first() {
            let what = format!("a <scene> has no parameters, found \"{}\"", param.name);
            return Err(self.error(param.name_at, what));
        }
        Ok(owner)
    }

    fn add(&mut self, plugin: &'static plugins::Plugin, id: Option<String>, at: Span) -> ObjectId {
        let object = ObjectId(self.objects.len() as u32);
        self.objects.push(Object {
            plugin,
            id,
            at,
            params: Vec::new(),
            children: Vec::new(),
            visited: Mark::default(),
        });
        self.children.push(Vec::new());
        object
    }

    /// The elements inside an object.
    fn content(
        &mut self,
        file: File<'_>,
        parent: Node<'_, '_>,
        owner: ObjectId,
        params: &mut Vec<Given>,
    ) -> Result<(), SceneError> {
        for node in parent.children() {
            if node.is_text() {
                self.check_text(file, node)?;
            }
            if !node.is_element() {
                continue;
            }
            let tag = node.tag_name().name();
            match tag {
                "default" => self.default(file, node)?,
                "path" => self.path(file, node)?,
                "include" => self.include(file, node, owner)?,
                "alias" => self.alias(file, node)?,
                "ref" => self.reference(file, node, owner)?,
                "spectrum" if node.has_attribute("type") => self.object(file, node, owner)?,
                _ if VALUE_TAGS.contains(&tag) => params.push(self.value(file, node)?),
                _ => self.object(file, node, owner)?,
            }
        }
        Ok(())
    }

    fn object(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        parent: ObjectId,
    ) -> Result<(), SceneError> {
        let tag = node.tag_name().name();
        let category = match tag {
            "spectrum" => Some(Category::Texture),
            "scene" => None,
            tag => Category::from_tag(tag),
        };
        let Some(category) = category else {
            return Err(self.unknown_tag(file, node));
        };
        let is_root = node.parent().is_some_and(|p| p.is_root());
        let version = if is_root { "version" } else { "type" };
        self.check_attributes(file, node, &["type", "id", "name", version])?;
        let kind = self.required(file, node, "type")?;
        let plugin = check::plugin(category, &kind.text, || self.place(kind.at))?;
        let id = self.attribute(file, node, "id")?;
        let object = self.add(plugin, id.as_ref().map(|id| id.text.clone()), kind.at);
        if let Some(id) = id {
            self.define(id, object)?;
        }
        let name = self.attribute(file, node, "name")?;
        let mut params = Vec::new();
        self.content(file, node, object, &mut params)?;
        if file.old {
            upgrade::texture_coordinates(&mut params)
                .map_err(|at| self.error(at, "a scale of texture coordinates is 0"))?;
            let taken = params.iter().any(|p| p.name == "reflectance")
                || has_child(&self.children[object.index()], "reflectance");
            for given in &mut params {
                given.name = upgrade::rename(plugin.name, &given.name, taken).to_string();
            }
            for child in &mut self.children[object.index()] {
                let renamed = child.name.as_deref();
                let renamed = renamed.map(|name| upgrade::rename(plugin.name, name, taken).into());
                child.name = renamed;
            }
        }
        let find_place = |at: Span| place(&self.sources, at);
        let find = |name: &str| self.find_file(name, file.folder);
        check::params(plugin, &mut params, &find_place, &find)?;
        self.objects[object.index()].params = params;
        let at = name.as_ref().map_or(kind.at, |name| name.at);
        self.children[parent.index()].push(RawChild {
            name: name.map(|name| current_name(file, name.text)),
            target: Target::Object(object),
            at,
        });
        Ok(())
    }

    fn define(&mut self, id: Attribute, object: ObjectId) -> Result<(), SceneError> {
        if let Some((_, first)) = self.ids.get(&id.text) {
            let what = format!(
                "the id \"{}\" is taken; the first is at {}",
                id.text,
                self.place(*first)
            );
            return Err(self.error(id.at, what));
        }
        self.ids.insert(id.text, (object, id.at));
        Ok(())
    }

    fn default(&mut self, file: File<'_>, node: Node<'_, '_>) -> Result<(), SceneError> {
        self.leaf(file, node, &["name", "value"])?;
        let name = self.required(file, node, "name")?;
        let value = self.required(file, node, "value")?;
        if name.text.is_empty() {
            return Err(self.error(name.at, "the name of a parameter is empty"));
        }
        self.parameters.set_default(&name.text, &value.text);
        Ok(())
    }

    fn path(&mut self, file: File<'_>, node: Node<'_, '_>) -> Result<(), SceneError> {
        self.leaf(file, node, &["value"])?;
        let value = self.required(file, node, "value")?;
        let folder = self
            .candidates(&value.text, file.folder)
            .find(|p| p.is_dir());
        let Some(folder) = folder else {
            let what = format!("no folder \"{}\"", value.text);
            return Err(self.error(value.at, what));
        };
        if !self.folders.contains(&folder) {
            self.folders.push(folder);
        }
        Ok(())
    }

    fn include(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        owner: ObjectId,
    ) -> Result<(), SceneError> {
        self.leaf(file, node, &["filename"])?;
        let name = self.required(file, node, "filename")?;
        if file.depth >= limits::INCLUDE_DEPTH || self.sources.len() > limits::INCLUDES {
            let what = format!("too many includes, at \"{}\"", name.text);
            let help = format!(
                "files may include files up to {} deep; does this one include itself?",
                limits::INCLUDE_DEPTH
            );
            return Err(self.error(name.at, what).with_help(help));
        }
        let failed =
            |what: String| self.error(name.at, format!("cannot include \"{}\": {what}", name.text));
        let path = self
            .find_file(&name.text, file.folder)
            .map_err(|wrong| self.wrong(name.at, wrong))?;
        let text = read_text(&path).map_err(failed)?;
        if self.bytes + text.len() as u64 > limits::XML_TOTAL_BYTES {
            let mib = limits::XML_TOTAL_BYTES >> 20;
            return Err(failed(format!("all files together exceed {mib} MiB")));
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let source = Source {
            name: path,
            text: text.into(),
        };
        self.document(source, &folder, file.depth + 1, Some(owner))?;
        Ok(())
    }

    fn alias(&mut self, file: File<'_>, node: Node<'_, '_>) -> Result<(), SceneError> {
        self.leaf(file, node, &["id", "as"])?;
        let id = self.required(file, node, "id")?;
        let new = self.required(file, node, "as")?;
        let Some(&(object, _)) = self.ids.get(&id.text) else {
            let mut known: Vec<&str> = self.ids.keys().map(String::as_str).collect();
            known.sort_unstable();
            let what = format!("no object before this has the id \"{}\"", id.text);
            let help = did_you_mean(&id.text, known);
            return Err(self.error(id.at, what).with_help_opt(help));
        };
        self.define(new, object)
    }

    fn reference(
        &mut self,
        file: File<'_>,
        node: Node<'_, '_>,
        owner: ObjectId,
    ) -> Result<(), SceneError> {
        self.leaf(file, node, &["id", "name"])?;
        let id = self.required(file, node, "id")?;
        // A reference at the top of a scene adds nothing: the object is there already.
        if self.objects[owner.index()].plugin.category == Category::Scene {
            let what = "a <ref> must stand inside the object that uses it";
            return Err(self.error(id.at, what));
        }
        let name = self.attribute(file, node, "name")?;
        let at = name.as_ref().map_or(id.at, |name| name.at);
        self.children[owner.index()].push(RawChild {
            name: name.map(|name| current_name(file, name.text)),
            target: Target::Id(id.text, id.at),
            at,
        });
        Ok(())
    }
}

fn has_child(children: &[RawChild], name: &str) -> bool {
    children.iter().any(|c| c.name.as_deref() == Some(name))
}

/// The first of three numbers with dots between them.
fn major_version(text: &str) -> Option<u32> {
    let mut parts = text.split('.').map(|part| part.parse::<u32>().ok());
    let major = parts.next()??;
    let rest: Option<Vec<u32>> = parts.collect();
    (rest?.len() == 2).then_some(major)
}
