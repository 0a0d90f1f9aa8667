//! From the description back to JSON.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json, json};

use crate::base64;
use crate::declare::{ParamKind, PluginDecl};
use crate::describe::*;
use crate::error::Error;
use crate::format::VERSION;
use crate::plugin::{PluginBlock, Value};
use crate::texture::*;
use crate::transform::Transform;

impl Scene {
    /// The scene as JSON text that reads as an equal scene. A description that breaks the format's rules,
    /// such as a radiance that is not finite, is an error: [`Error::Invalid`], with places in the text
    /// that would have been written.
    pub fn to_text(&self) -> Result<String, Error> {
        let mut text = String::new();
        pretty(&self.to_json(), 0, &mut text);
        text.push('\n');
        // Reading it back checks a description built in memory by the same rules as a file.
        Scene::parse(text.as_bytes(), &self.source.file)?;
        Ok(text)
    }

    /// Writes the scene to a file. Relative paths keep their meaning only if [`Scene::rebase`] has been
    /// called for the file's folder, or if it is the folder of [`Scene::source`].
    pub fn write(&self, file: impl AsRef<Path>) -> Result<(), Error> {
        let file = file.as_ref();
        let text = self.to_text()?;
        std::fs::write(file, text).map_err(|source| Error::Io {
            file: file.to_path_buf(),
            source,
        })
    }

    /// Makes the scene one that stands in `file`: relative paths are rewritten so that they lead to the
    /// same files from its folder. `decls` tell which parameters of plugins are paths.
    pub fn rebase(&mut self, file: impl Into<PathBuf>, decls: &[PluginDecl]) -> Result<(), Error> {
        let file = file.into();
        let io = |source| Error::Io {
            file: file.clone(),
            source,
        };
        let from = std::path::absolute(if self.base().as_os_str().is_empty() {
            Path::new(".")
        } else {
            self.base()
        });
        let to = std::path::absolute(&file);
        let rebase = Rebase {
            from: from.map_err(io)?,
            to: to.map_err(io)?,
            decls,
        };
        for light in &mut self.lights {
            if let Light::Environment(Environment::Image { file, .. }) = light {
                rebase.path(file);
            }
        }
        let shapes = self.shapes.iter_mut();
        for shape in shapes.chain(self.prototypes.values_mut().flatten()) {
            if let Geometry::Ply { file, .. } | Geometry::Gltf { file, .. } = &mut shape.geometry {
                rebase.path(file);
            }
        }
        for instance in &mut self.instances {
            if let Some(file) = &mut instance.transforms {
                rebase.path(file);
            }
        }
        rebase.block(&mut self.integrator);
        for texture in self.textures.values_mut() {
            if let ImageSource::File(file) = &mut texture.image {
                rebase.path(file);
            }
        }
        self.materials
            .values_mut()
            .for_each(|m| rebase.block(&mut m.block));
        self.media
            .values_mut()
            .for_each(|medium| rebase.block(&mut medium.block));
        self.source = Source { file };
        Ok(())
    }

    fn to_json(&self) -> Json {
        let mut root = json!({"resolvent": VERSION});
        if self.units != Units::default() {
            root["units"] = json!({"meters_per_unit": self.units.meters_per_unit});
        }
        root["camera"] = camera(&self.camera);
        root["film"] = film(&self.film);
        root["sampling"] = sampling(&self.sampling);
        root["integrator"] = block(&self.integrator);
        root["lights"] = self.lights.iter().map(light).collect();
        if !self.textures.is_empty() {
            root["textures"] = Json::Object(
                self.textures
                    .iter()
                    .map(|(name, t)| (name.clone(), texture(t)))
                    .collect(),
            );
        }
        root["materials"] = Json::Object(
            self.materials
                .iter()
                .map(|(name, m)| (name.clone(), material(m)))
                .collect(),
        );
        root["media"] = Json::Object(
            self.media
                .iter()
                .map(|(name, m)| (name.clone(), medium(m)))
                .collect(),
        );
        root["shapes"] = self.shapes.iter().map(shape).collect();
        if !self.prototypes.is_empty() {
            let shapes = |s: &Vec<Shape>| s.iter().map(shape).collect();
            root["prototypes"] = Json::Object(
                self.prototypes
                    .iter()
                    .map(|(name, s)| (name.clone(), shapes(s)))
                    .collect(),
            );
        }
        if !self.instances.is_empty() {
            root["instances"] = self.instances.iter().map(instance).collect();
        }
        root
    }
}

struct Rebase<'a> {
    from: PathBuf,
    to: PathBuf,
    decls: &'a [PluginDecl],
}

impl Rebase<'_> {
    fn path(&self, path: &mut String) {
        if Path::new(path.as_str()).is_relative() {
            let target = self.from.join(path.as_str());
            let target = match self
                .to
                .parent()
                .and_then(|folder| target.strip_prefix(folder).ok())
            {
                Some(below) => below.to_path_buf(),
                None => target,
            };
            // Both parts came from text or from the system's own idea of the current folder.
            *path = target.to_string_lossy().into_owned();
        }
    }

    fn block(&self, block: &mut PluginBlock) {
        if block.is_path() {
            self.path(&mut block.plugin);
        }
        let name = block.plugin.as_str();
        let files: Vec<&str> = self
            .decls
            .iter()
            .filter(|d| d.name == name)
            .flat_map(|d| &d.params)
            .filter(|p| p.kind == ParamKind::File)
            .map(|p| p.name.as_str())
            .collect();
        for (key, param) in &mut block.params {
            match &mut param.value {
                Value::Text(t) if files.contains(&key.as_str()) => self.path(t),
                Value::Object(nested) => self.block(nested),
                _ => {}
            }
        }
    }
}

/// A spectrum as short as it can be.
fn spectrum(s: Vec3) -> Json {
    if s[0] == s[1] && s[1] == s[2] {
        json!(s[0])
    } else {
        json!(s)
    }
}

/// Adds a transform that is not the identity.
fn put_transform(out: &mut Json, t: &Transform) {
    if *t != Transform::IDENTITY {
        out["transform"] = json!(t.0);
    }
}

fn camera(c: &Camera) -> Json {
    let mut out = match c.projection {
        Projection::Perspective { .. } => json!({"type": "perspective"}),
        Projection::Orthographic { .. } => json!({"type": "orthographic"}),
    };
    match &c.pose {
        Pose::LookAt { origin, target, up } => {
            out["origin"] = json!(origin);
            out["target"] = json!(target);
            out["up"] = json!(up);
        }
        Pose::Transform(t) => out["transform"] = json!(t.0),
    }
    match c.projection {
        Projection::Perspective { fov_x_deg } => {
            out["fov_x_deg"] = json!(fov_x_deg);
            out["lens_radius"] = json!(c.lens_radius);
            out["focus_distance"] = json!(c.focus_distance);
        }
        Projection::Orthographic { width } => out["width"] = json!(width),
    }
    if c.shift != [0.0; 2] {
        out["shift"] = json!(c.shift);
    }
    if c.exposure != 0.0 {
        out["exposure"] = json!(c.exposure);
    }
    out
}

fn film(f: &Film) -> Json {
    let mut out = json!({"resolution": f.resolution});
    if f.pixel_aspect != 1.0 {
        out["pixel_aspect"] = json!(f.pixel_aspect);
    }
    if let Some(crop) = f.crop {
        out["crop"] = json!(crop);
    }
    out["filter"] = match f.filter {
        Filter::Box { radius } => json!({"type": "box", "radius": radius}),
        Filter::Tent { radius } => json!({"type": "tent", "radius": radius}),
        Filter::Gaussian { radius, sigma } => {
            json!({"type": "gaussian", "radius": radius, "sigma": sigma})
        }
    };
    if !f.aovs.is_empty() {
        out["aovs"] = f.aovs.iter().map(|a| a.to_string()).collect();
    }
    out
}

fn sampling(s: &Sampling) -> Json {
    let mut out = match s.budget {
        Budget::Spp(n) => json!({"spp": n}),
        Budget::Time(t) => json!({"time": t}),
        Budget::Error(e) => json!({"error": e}),
    };
    out["seed"] = json!(s.seed);
    out
}

fn light(l: &Light) -> Json {
    match l {
        Light::Environment(Environment::Constant { radiance }) => {
            json!({"type": "environment", "radiance": spectrum(*radiance)})
        }
        Light::Environment(Environment::Image {
            file,
            mapping,
            scale,
            rotation,
        }) => {
            let mut out = json!({"type": "environment", "image": file, "scale": spectrum(*scale)});
            if *mapping != Mapping::default() {
                out["mapping"] = json!(word(&MAPPINGS, *mapping));
            }
            put_transform(&mut out, rotation);
            out
        }
        Light::Distant {
            to_light,
            irradiance,
            angle_deg,
        } => {
            json!({"type": "distant", "to_light": to_light, "irradiance": spectrum(*irradiance), "angle_deg": angle_deg})
        }
        Light::Point {
            position,
            intensity,
        } => {
            json!({"type": "point", "position": position, "intensity": spectrum(*intensity)})
        }
        Light::SunSky {
            to_sun,
            turbidity,
            ground_albedo,
            scale,
            sun,
            sun_angle_deg,
            rotation,
        } => {
            let mut out = json!({
                "type": "sun_sky", "to_sun": to_sun, "turbidity": turbidity,
                "ground_albedo": spectrum(*ground_albedo), "scale": spectrum(*scale),
                "sun": sun, "sun_angle_deg": sun_angle_deg,
            });
            put_transform(&mut out, rotation);
            out
        }
        Light::Spot {
            position,
            direction,
            intensity,
            angle_deg,
            inner_angle_deg,
        } => json!({
            "type": "spot", "position": position, "direction": direction,
            "intensity": spectrum(*intensity), "angle_deg": angle_deg,
            "inner_angle_deg": inner_angle_deg,
        }),
        Light::Rectangle {
            corner,
            edge_u,
            edge_v,
            radiance,
            two_sided,
        } => json!({
            "type": "rectangle", "corner": corner, "edge_u": edge_u, "edge_v": edge_v,
            "radiance": spectrum(*radiance), "two_sided": two_sided,
        }),
    }
}

fn block(b: &PluginBlock) -> Json {
    let mut out = json!({"plugin": b.plugin});
    if !b.params.is_empty() {
        let params: Map<_, _> = b
            .params
            .iter()
            .map(|(name, p)| (name.clone(), value(&p.value)))
            .collect();
        out["params"] = Json::Object(params);
    }
    out
}

pub(crate) fn value(v: &Value) -> Json {
    match v {
        Value::Bool(b) => json!(b),
        Value::Number(x) => json!(x),
        Value::Text(t) => json!(t),
        Value::List(items) => items.iter().map(value).collect(),
        Value::Object(b) => block(b),
        Value::Texture(name) => json!({"texture": name}),
    }
}

fn texture(t: &Texture) -> Json {
    let mut out = match &t.image {
        ImageSource::File(file) => json!({"file": file}),
        ImageSource::Memory(image) => json!({"data": base64::encode(&image.bytes)}),
        ImageSource::White => json!({}),
    };
    if t.vertex_color || t.image == ImageSource::White {
        out["vertex_color"] = json!(t.vertex_color);
    }
    out["color_space"] = json!(word(&COLOR_SPACES, t.color_space));
    let [u, v] = t.wrap.map(|w| word(&WRAPS, w));
    if u == v {
        out["wrap"] = json!(u);
    } else {
        out["wrap_u"] = json!(u);
        out["wrap_v"] = json!(v);
    }
    out["filter"] = json!(word(&FILTERS, t.filter));
    if let Some(channel) = t.channel {
        out["channel"] = json!(word(&CHANNELS, channel));
    }
    out["scale"] = spectrum(t.scale);
    out["bias"] = spectrum(t.bias);
    if t.uv != UvTransform::default() {
        out["uv_transform"] = json!({
            "scale": t.uv.scale, "rotation_deg": t.uv.rotation_deg, "offset": t.uv.offset,
        });
    }
    out
}

fn material(m: &Material) -> Json {
    let mut out = block(&m.block);
    if let Some(map) = &m.normal_map {
        out["normal_map"] = json!({"texture": map.texture, "scale": map.scale});
    }
    out
}

fn medium(m: &Medium) -> Json {
    let mut out = block(&m.block);
    put_transform(&mut out, &m.transform);
    out
}

fn shape(s: &Shape) -> Json {
    let mut out = match &s.geometry {
        Geometry::Sphere { center, radius } => {
            json!({"type": "sphere", "center": center, "radius": radius})
        }
        Geometry::Rectangle {
            corner,
            edge_u,
            edge_v,
        } => {
            json!({"type": "rectangle", "corner": corner, "edge_u": edge_u, "edge_v": edge_v})
        }
        Geometry::Disk {
            center,
            normal,
            radius,
        } => {
            json!({"type": "disk", "center": center, "normal": normal, "radius": radius})
        }
        Geometry::Cylinder { base, axis, radius } => {
            json!({"type": "cylinder", "base": base, "axis": axis, "radius": radius})
        }
        Geometry::Mesh(m) => {
            let mut out = json!({"type": "mesh", "positions": m.positions, "indices": m.indices});
            if !m.normals.is_empty() {
                out["normals"] = json!(m.normals);
            }
            if !m.uvs.is_empty() {
                out["uvs"] = json!(m.uvs);
            }
            if !m.colors.is_empty() {
                out["colors"] = json!(m.colors);
            }
            if !m.tangents.is_empty() {
                out["tangents"] = json!(m.tangents);
            }
            put_transform(&mut out, &m.transform);
            out
        }
        Geometry::Gltf { file, transform } => {
            let mut out = json!({"type": "gltf", "file": file});
            put_transform(&mut out, transform);
            out
        }
        Geometry::Ply { file, transform } => {
            let mut out = json!({"type": "ply", "file": file});
            put_transform(&mut out, transform);
            out
        }
    };
    if let Some(material) = &s.material {
        out["material"] = json!(material);
    }
    if let Some(emission) = s.emission {
        out["emission"] = spectrum(emission);
        if let Some(texture) = &s.emission_texture {
            out["emission_texture"] = json!(texture);
        }
        if s.two_sided {
            out["two_sided"] = json!(true);
        }
        if let Some(s) = s.shaping {
            out["shaping"] = json!({
                "axis": s.axis, "angle_deg": s.angle_deg, "softness": s.softness,
                "focus": s.focus, "focus_tint": spectrum(s.focus_tint),
            });
        }
    }
    if let Some(interior) = &s.interior {
        out["interior"] = json!(interior);
    }
    if s.priority != 0 {
        out["priority"] = json!(s.priority);
    }
    out
}

fn instance(i: &Instance) -> Json {
    let mut out = json!({"prototype": i.prototype});
    put_transform(&mut out, &i.transform);
    if let Some(file) = &i.transforms {
        out["transforms"] = json!(file);
    }
    if let Some(material) = &i.material {
        out["material"] = json!(material);
    }
    out
}

/// Writes with two spaces of indentation, and on one line what fits on one.
pub(crate) fn pretty(json: &Json, indent: usize, out: &mut String) {
    const WIDTH: usize = 96;
    let flat_size = match json {
        Json::Array(items) => items.len(),
        Json::Object(members) => members.len(),
        _ => 0,
    };
    // Few enough members to possibly fit: without this, every level of a large mesh would be written flat.
    if flat_size * 2 <= WIDTH && indent > 0 || flat_size == 0 {
        let flat = flat(json);
        if flat.len() + indent <= WIDTH || flat_size == 0 {
            out.push_str(&flat);
            return;
        }
    }
    let inner = indent + 2;
    let line = |out: &mut String, at: usize| {
        out.push('\n');
        out.extend(std::iter::repeat_n(' ', at));
    };
    match json {
        Json::Array(items) => {
            out.push('[');
            for (i, item) in items.iter().enumerate() {
                out.push_str(if i > 0 { "," } else { "" });
                line(out, inner);
                pretty(item, inner, out);
            }
            line(out, indent);
            out.push(']');
        }
        Json::Object(members) => {
            out.push('{');
            for (i, (key, item)) in members.iter().enumerate() {
                out.push_str(if i > 0 { "," } else { "" });
                line(out, inner);
                out.push_str(&Json::from(key.as_str()).to_string());
                out.push_str(": ");
                pretty(item, inner, out);
            }
            line(out, indent);
            out.push('}');
        }
        scalar => out.push_str(&scalar.to_string()),
    }
}

/// On one line, with a space after commas and colons.
fn flat(json: &Json) -> String {
    match json {
        Json::Array(items) => format!(
            "[{}]",
            items.iter().map(flat).collect::<Vec<_>>().join(", ")
        ),
        Json::Object(members) => {
            let parts = members
                .iter()
                .map(|(k, v)| format!("{}: {}", Json::from(k.as_str()), flat(v)));
            format!("{{{}}}", parts.collect::<Vec<_>>().join(", "))
        }
        scalar => scalar.to_string(),
    }
}
