//! From checked JSON to the description, and the checks that see more than one value.
//!
//! Runs after [`crate::check`]: whatever the tables can say has been checked, so a `None` here means only
//! that a key was left out.

mod camera;
mod light;
mod params;
mod shape;
mod texture;
mod values;

use indexmap::IndexMap;
use std::path::Path;

use crate::check::Checker;
use crate::describe::{Film, Medium, Sampling, Scene, Source, Units};
use crate::error::{Error, Problem};
use crate::format::{Kind, SCENE, VERSION};
use crate::json::{Data, Document, Node, quoted};
use crate::nearest::hint;
use crate::plugin::PluginBlock;
use shape::instance;
use values::{items, list, members, number, to_world};

impl Scene {
    /// Reads a scene file.
    pub fn read(file: impl AsRef<Path>) -> Result<Scene, Error> {
        let file = file.as_ref();
        let io = |source| Error::Io {
            file: file.to_path_buf(),
            source,
        };
        let mut bytes = Vec::new();
        // One byte more than is accepted, so that an endless file (a pipe, /dev/zero) ends, too.
        let open = std::fs::File::open(file).map_err(io)?;
        std::io::Read::read_to_end(
            &mut std::io::Read::take(open, crate::json::MAX_BYTES + 1),
            &mut bytes,
        )
        .map_err(io)?;
        Scene::parse(&bytes, file)
    }

    /// Reads a scene from memory. `file` names it in errors, and its folder is where relative paths start.
    pub fn parse(bytes: &[u8], file: impl AsRef<Path>) -> Result<Scene, Error> {
        let file = file.as_ref();
        let doc = Document::parse(bytes)
            .map_err(|e| Error::Syntax(Problem::new(file, e.place, e.what)))?;
        check_version(&doc, file)?;
        let mut checker = Checker::new(&doc, file);
        checker.check(&doc.root, &Kind::Object(&SCENE));
        checker.finish().map_err(Error::Invalid)?;

        let mut reader = Reader {
            checker: Checker::new(&doc, file),
            params: 0,
        };
        let scene = reader.scene(&doc.root, file);
        reader.checker.finish().map_err(Error::Invalid)?;
        scene.ok_or_else(|| {
            let place = doc.place(&doc.root);
            Error::Invalid(vec![Problem::new(file, place, "the scene is incomplete")])
        })
    }
}

/// A newer format may differ in anything, so its version is looked at before all else.
fn check_version(doc: &Document<'_>, file: &Path) -> Result<(), Error> {
    let Some(node) = doc.root.get("resolvent") else {
        return Ok(());
    };
    match doc.integer(node) {
        Some(found) if found > i128::from(VERSION) => Err(Error::Unsupported(Problem::new(
            file,
            doc.place(node),
            format!(
                "the scene has format version {found}, this program reads up to {VERSION}; update the program"
            ),
        ))),
        _ => Ok(()),
    }
}

/// Most parameters and nested plugins of one scene: each keeps its place, so they cost much more memory
/// than text.
const MAX_PARAMS: usize = 200_000;

pub(crate) struct Reader<'d> {
    pub(crate) checker: Checker<'d>,
    params: usize,
}

impl Reader<'_> {
    fn scene(&mut self, root: &Node, file: &Path) -> Option<Scene> {
        let scene = Scene {
            source: Source {
                file: file.to_path_buf(),
            },
            units: root
                .get("units")
                .and_then(|n| number(n, "meters_per_unit"))
                .map_or_else(Units::default, |m| Units { meters_per_unit: m }),
            camera: self.camera(root.get("camera")?)?,
            film: root
                .get("film")
                .map_or_else(|| Some(Film::default()), |n| self.film(n))?,
            sampling: root
                .get("sampling")
                .map_or_else(|| Some(Sampling::default()), |n| self.sampling(n))?,
            integrator: match root.get("integrator") {
                Some(n) => self.block(n)?,
                None => PluginBlock::new("pt"),
            },
            lights: list(root, "lights")
                .iter()
                .map(|n| self.light(n))
                .collect::<Option<_>>()?,
            textures: named(root, "textures", |n| self.texture(n))?,
            materials: named(root, "materials", |n| self.material(n))?,
            media: named(root, "media", |n| self.medium(n))?,
            shapes: self.shapes(list(root, "shapes"))?,
            prototypes: named(root, "prototypes", |n| {
                if items(n).is_empty() {
                    self.checker.report(n, "expected at least one shape");
                }
                self.shapes(items(n))
            })?,
            instances: list(root, "instances")
                .iter()
                .map(instance)
                .collect::<Option<_>>()?,
        };
        self.references(root, &scene);
        Some(scene)
    }

    /// Reports names of textures, materials, media and prototypes that nothing has.
    fn references(&mut self, root: &Node, scene: &Scene) {
        for (node, material) in members(root, "materials").zip(scene.materials.values()) {
            self.known_textures(node, material, &scene.textures);
        }
        let prototypes = match root.get("prototypes").map(|n| &n.data) {
            Some(Data::Object(members)) => members.as_slice(),
            _ => &[],
        };
        let nodes = prototypes.iter().flat_map(|m| items(&m.value));
        for (node, shape) in list(root, "shapes")
            .iter()
            .chain(nodes)
            .zip(scene.all_shapes())
        {
            let (material, interior) = (shape.material.as_deref(), shape.interior.as_deref());
            self.known(node.get("material"), material, "material", &scene.materials);
            self.known(node.get("interior"), interior, "medium", &scene.media);
            let texture = shape.emission_texture.as_deref();
            self.known(
                node.get("emission_texture"),
                texture,
                "texture",
                &scene.textures,
            );
        }
        for (node, instance) in list(root, "instances").iter().zip(&scene.instances) {
            let (prototype, material) = (&instance.prototype, instance.material.as_deref());
            self.known(
                node.get("prototype"),
                Some(prototype),
                "prototype",
                &scene.prototypes,
            );
            self.known(node.get("material"), material, "material", &scene.materials);
        }
    }

    /// Reports a name that nothing has.
    fn known<T>(
        &mut self,
        node: Option<&Node>,
        name: Option<&str>,
        what: &str,
        all: &IndexMap<String, T>,
    ) {
        if let (Some(node), Some(name)) = (node, name)
            && !all.contains_key(name)
            && !self.checker.is_full()
        {
            let hint = hint(name, all.keys().map(String::as_str));
            self.checker
                .report(node, format!("no {what} is named {}{hint}", quoted(name)));
        }
    }

    fn medium(&mut self, node: &Node) -> Option<Medium> {
        Some(Medium {
            block: self.block(node)?,
            transform: to_world(node)?,
        })
    }
}

fn named<T>(
    node: &Node,
    key: &str,
    mut read: impl FnMut(&Node) -> Option<T>,
) -> Option<IndexMap<String, T>> {
    match node.get(key).map(|n| &n.data) {
        Some(Data::Object(members)) => members
            .iter()
            .map(|m| Some((m.key.to_string(), read(&m.value)?)))
            .collect(),
        _ => Some(IndexMap::new()),
    }
}
