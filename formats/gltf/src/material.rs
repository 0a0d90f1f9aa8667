//! Materials: metallic-roughness and the KHR_materials extensions, as parameters of the BSDFs `principled` and `mask`.

use resolvent_scene::{
    ColorSpace, ImageSource, IndexMap, Material, Medium, NormalMap, PluginBlock, Texture,
    TextureChannel, TextureFilter, Transform, UvTransform, Value as Param, Wrap,
};
use serde_json::Value;
use std::collections::{HashMap, HashSet};

use crate::error::Fallible;
use crate::values::{element, extension, index, number, numbers, short};

/// What a glTF material becomes.
#[derive(Clone, Default)]
pub(crate) struct Converted {
    /// Name of the material in the scene.
    pub material: String,
    /// Name of the absorbing medium inside.
    pub interior: Option<String>,
    /// Radiance, if it glows.
    pub emission: Option<[f64; 3]>,
    /// Name of the texture that the radiance is multiplied with.
    pub emission_texture: Option<String>,
    /// Both sides glow.
    pub two_sided: bool,
    /// The set of texture coordinates that its textures use.
    pub uv_set: u32,
    /// It has a normal map, for which tangents count.
    pub has_normal_map: bool,
}

/// Collects what materials need.
pub(crate) struct Materials<'c> {
    pub raw: &'c Value,
    /// Put before every name.
    pub prefix: String,
    pub images: Vec<Fallible<ImageSource>>,
    pub textures: IndexMap<String, Texture>,
    pub materials: IndexMap<String, Material>,
    pub media: IndexMap<String, Medium>,
    pub warnings: Vec<String>,
    warned: HashSet<String>,
    /// By index (`None` is the default material) and whether vertices have colours.
    done: HashMap<Wanted, Converted>,
}

/// Index of a material, and whether the colours of vertices are factors of its base colour.
type Wanted = (Option<usize>, bool);

/// How a texture is used.
#[derive(Clone, Copy)]
struct Use {
    space: ColorSpace,
    channel: Option<TextureChannel>,
    scale: [f64; 3],
    /// Added after that.
    bias: f64,
    /// Multiplied with the colours of vertices, and there for them alone if the material names no image.
    vertex_color: bool,
}

const COLOR: Use = Use {
    space: ColorSpace::Srgb,
    channel: None,
    scale: [1.0; 3],
    bias: 0.0,
    vertex_color: false,
};

const NORMAL: Use = Use {
    space: ColorSpace::Linear,
    ..COLOR
};

fn data(channel: TextureChannel, factor: f64) -> Use {
    Use {
        space: ColorSpace::Linear,
        channel: Some(channel),
        scale: [factor; 3],
        bias: 0.0,
        vertex_color: false,
    }
}

/// Largest index of a film.
const FILM_IOR: f64 = 5.0;
const UNIT: [f64; 2] = [0.0, 1.0];
const BRIGHT: [f64; 2] = [0.0, 1e30];

impl<'c> Materials<'c> {
    pub fn new(raw: &'c Value, prefix: String, images: Vec<Fallible<ImageSource>>) -> Self {
        Self {
            raw,
            prefix,
            images,
            textures: IndexMap::new(),
            materials: IndexMap::new(),
            media: IndexMap::new(),
            warnings: Vec::new(),
            warned: HashSet::new(),
            done: HashMap::new(),
        }
    }

    /// The material of an index, or the default one, converted on first use; with `colored` its base colour is multiplied with the
    /// colours of vertices.
    pub fn get(&mut self, index: Option<usize>, colored: bool) -> Fallible<Converted> {
        let wanted = (index, colored);
        if let Some(c) = self.done.get(&wanted) {
            return Ok(c.clone());
        }
        let none = Value::Object(serde_json::Map::new());
        let (value, at) = match index {
            Some(i) => (
                element(self.raw, "materials", i).ok_or("a material does not exist")?,
                format!("materials[{i}]"),
            ),
            None => (&none, "the default material".to_owned()),
        };
        let name = match (index, value.get("name").and_then(Value::as_str)) {
            (Some(i), Some(name)) => format!("{}material {i} {}", self.prefix, short(name)),
            (Some(i), None) => format!("{}material {i}", self.prefix),
            (None, _) => format!("{}default material", self.prefix),
        };
        let name = if colored {
            format!("{name} with colors")
        } else {
            name
        };
        let converted = self
            .convert(value, name, colored)
            .map_err(|what| format!("{at}.{what}"))?;
        self.done.insert(wanted, converted.clone());
        Ok(converted)
    }

    fn convert(&mut self, m: &Value, name: String, colored: bool) -> Fallible<Converted> {
        let none = Value::Null;
        let pbr = m.get("pbrMetallicRoughness").unwrap_or(&none);
        let mut out = Converted {
            material: name.clone(),
            two_sided: m
                .get("doubleSided")
                .and_then(Value::as_bool)
                .unwrap_or(false),
            ..Converted::default()
        };
        out.uv_set = self.uv_set(m, pbr, &name);
        let base = numbers(pbr, "baseColorFactor", [1.0; 4], UNIT)?;
        let color = [base[0], base[1], base[2]];
        let unlit = extension(m, "KHR_materials_unlit").is_some();

        let mut emission = numbers(m, "emissiveFactor", [0.0; 3], UNIT)?;
        if let Some(e) = extension(m, "KHR_materials_emissive_strength") {
            let strength = number(e, "emissiveStrength", 1.0, BRIGHT)?;
            emission = emission.map(|v| v * strength);
        }
        let (mut glow, mut shade) = (m.get("emissiveTexture"), COLOR);
        let mut block = if unlit {
            // Shows its colour whatever the light: a black surface that glows.
            emission = color;
            glow = pbr.get("baseColorTexture");
            shade.vertex_color = colored;
            PluginBlock::new("diffuse").with("reflectance", 0.0)
        } else {
            let base = Use {
                scale: color,
                vertex_color: colored,
                ..COLOR
            };
            self.principled(m, pbr, base, &name, &mut out)?
        };
        if emission.iter().any(|v| *v > 0.0) {
            out.emission = Some(emission);
            out.emission_texture = self.texture(glow, &name, "emission", shade)?;
        }
        let alpha = Use {
            vertex_color: colored,
            ..data(TextureChannel::Alpha, base[3])
        };
        block = self.opacity(m, pbr, alpha, block, &name)?;
        if m.get("occlusionTexture").is_some() {
            self.warn("occlusionTexture", "light transport finds occlusion itself");
        }
        let normal_map = match m.get("normalTexture").filter(|_| !unlit) {
            Some(info) => {
                let (texture, scale) = self.normals(info, &name, "normal")?;
                texture.map(|texture| NormalMap { texture, scale })
            }
            None => None,
        };
        out.has_normal_map |= normal_map.is_some();
        self.materials.insert(name, Material { block, normal_map });
        Ok(out)
    }

    /// The BSDF of a material that is lit.
    fn principled(
        &mut self,
        m: &Value,
        pbr: &Value,
        base: Use,
        name: &str,
        out: &mut Converted,
    ) -> Fallible<PluginBlock> {
        use TextureChannel::{Alpha, Blue, Green, Red};
        let mut block = PluginBlock::new("principled");
        let texture = self.texture(pbr.get("baseColorTexture"), name, "base color", base)?;
        block = block.with("base_color", either(texture, base.scale.into()));
        let rough = pbr.get("metallicRoughnessTexture");
        for (key, factor, channel, parameter) in [
            ("metallicFactor", 1.0, Blue, "metallic"),
            ("roughnessFactor", 1.0, Green, "roughness"),
        ] {
            let factor = number(pbr, key, factor, UNIT)?;
            block = self.scaled(block, rough, name, parameter, factor, channel)?;
        }
        let none = Value::Null;
        let of = |extension_name: &str| extension(m, extension_name);
        if let Some(e) = of("KHR_materials_ior") {
            let ior = number(e, "ior", 1.5, [0.0, 1e3])?;
            if ior == 0.0 {
                // An infinite index, for the specular-glossiness workflow: what is reflected is the specular colour.
                let specular = of("KHR_materials_specular").unwrap_or(&none);
                let f0 = numbers(specular, "specularColorFactor", [1.0; 3], BRIGHT)?;
                block = block.with("f0", f0.map(|v| v.min(1.0)));
            } else if (1.0..=5.0).contains(&ior) {
                block = block.with("ior", ior);
            } else {
                self.warn(
                    "KHR_materials_ior",
                    &format!("an index of {ior} is out of the range from 1 to 5; 1.5 is taken"),
                );
            }
        }
        if let Some(e) = of("KHR_materials_specular") {
            let factor = number(e, "specularFactor", 1.0, UNIT)?;
            let info = e.get("specularTexture");
            block = self.scaled(block, info, name, "specular", factor, Alpha)?;
            let tint = numbers(e, "specularColorFactor", [1.0; 3], BRIGHT)?;
            let setup = Use {
                scale: tint,
                ..COLOR
            };
            let info = e.get("specularColorTexture");
            let texture = self.texture(info, name, "specular color", setup)?;
            block = block.with("specular_color", either(texture, tint.into()));
        }
        if let Some(e) = of("KHR_materials_clearcoat") {
            let factor_of_coat = number(e, "clearcoatFactor", 0.0, UNIT)?;
            let info = e.get("clearcoatTexture");
            block = self.scaled(block, info, name, "clearcoat", factor_of_coat, Red)?;
            let factor = number(e, "clearcoatRoughnessFactor", 0.0, UNIT)?;
            let info = e.get("clearcoatRoughnessTexture");
            block = self.scaled(block, info, name, "clearcoat_roughness", factor, Green)?;
            if factor_of_coat > 0.0 {
                block = self.coat_normal(block, m, e, name, out)?;
            }
        }
        if let Some(e) = of("KHR_materials_iridescence") {
            block = self.film(block, e, name)?;
        }
        if let Some(e) = of("KHR_materials_sheen") {
            let tint = numbers(e, "sheenColorFactor", [0.0; 3], UNIT)?;
            let setup = Use {
                scale: tint,
                ..COLOR
            };
            let texture = self.texture(e.get("sheenColorTexture"), name, "sheen color", setup)?;
            let there = if tint == [0.0; 3] { 0.0 } else { 1.0 };
            block = block
                .with("sheen", there)
                .with("sheen_color", either(texture, tint.into()));
            let factor = number(e, "sheenRoughnessFactor", 0.0, UNIT)?;
            let info = e.get("sheenRoughnessTexture");
            block = self.scaled(block, info, name, "sheen_roughness", factor, Alpha)?;
        }
        let transmission = of("KHR_materials_transmission").unwrap_or(&none);
        let factor = number(transmission, "transmissionFactor", 0.0, UNIT)?;
        if factor > 0.0 {
            let info = transmission.get("transmissionTexture");
            block = self.scaled(block, info, name, "transmission", factor, Red)?;
            let volume = of("KHR_materials_volume").unwrap_or(&none);
            let thickness = number(volume, "thicknessFactor", 0.0, BRIGHT)?;
            block = block.with("thin", thickness == 0.0);
            if thickness > 0.0 {
                out.interior = self.absorbing(volume, name)?;
            }
        }
        Ok(block)
    }

    /// A thin film, of a thickness between the two that are given where a texture says so, else of the larger one.
    fn film(&mut self, block: PluginBlock, e: &Value, name: &str) -> Fallible<PluginBlock> {
        let factor = number(e, "iridescenceFactor", 0.0, UNIT)?;
        let ior = number(e, "iridescenceIor", 1.3, [1.0, 1e3])?;
        let least = number(e, "iridescenceThicknessMinimum", 100.0, BRIGHT)?;
        let most = number(e, "iridescenceThicknessMaximum", 400.0, BRIGHT)?;
        if factor == 0.0 {
            return Ok(block);
        }
        let info = e.get("iridescenceTexture");
        let block = self.scaled(block, info, name, "thin_film", factor, TextureChannel::Red)?;
        let setup = Use {
            bias: least,
            ..data(TextureChannel::Green, most - least)
        };
        let info = e.get("iridescenceThicknessTexture");
        let texture = self.texture(info, name, "thin film thickness", setup)?;
        if ior > FILM_IOR {
            let why = format!("an index of {ior} is above {FILM_IOR}, which is taken");
            self.warn("KHR_materials_iridescence", &why);
        }
        Ok(block
            .with("thin_film_thickness", either(texture, most.into()))
            .with("thin_film_ior", ior.min(FILM_IOR)))
    }

    /// A texture of normals, and the factor on their slope.
    fn normals(&mut self, info: &Value, name: &str, what: &str) -> Fallible<(Option<String>, f64)> {
        let scale = number(info, "scale", 1.0, [-1e6, 1e6])?;
        Ok((self.texture(Some(info), name, what, NORMAL)?, scale))
    }

    /// The coat's normals: its own, or those of the mesh where only the base is bumpy (KHR_materials_clearcoat, "Clearcoat").
    fn coat_normal(
        &mut self,
        block: PluginBlock,
        m: &Value,
        clearcoat: &Value,
        name: &str,
        out: &mut Converted,
    ) -> Fallible<PluginBlock> {
        let level = Param::from([0.5, 0.5, 1.0]);
        let Some(info) = clearcoat.get("clearcoatNormalTexture") else {
            let bumpy = m.get("normalTexture").is_some();
            return Ok(if bumpy {
                block.with("clearcoat_normal", level)
            } else {
                block
            });
        };
        out.has_normal_map = true;
        let (texture, scale) = self.normals(info, name, "clearcoat normal")?;
        Ok(block
            .with("clearcoat_normal", either(texture, level))
            .with("clearcoat_normal_scale", scale))
    }

    /// The medium inside: what white light becomes over a distance says how it absorbs.
    fn absorbing(&mut self, volume: &Value, name: &str) -> Fallible<Option<String>> {
        let color = numbers(volume, "attenuationColor", [1.0; 3], UNIT)?;
        let Some(distance) = volume.get("attenuationDistance").and_then(Value::as_f64) else {
            return Ok(None);
        };
        if !(distance > 0.0 && distance.is_finite()) || color == [1.0; 3] {
            return Ok(None);
        }
        // σ = −ln(color)/distance (KHR_materials_volume, "Attenuation"); black is as dark as f32 can say.
        let sigma = color.map(|c| -c.max(1e-30).ln() / distance);
        let medium = Medium {
            block: PluginBlock::new("homogeneous").with("sigma_a", sigma),
            transform: Transform::IDENTITY,
        };
        let name = format!("{name} inside");
        self.media.insert(name.clone(), medium);
        Ok(Some(name))
    }

    /// Opacity by the alpha mode: the mask lets through what is not there.
    fn opacity(
        &mut self,
        m: &Value,
        pbr: &Value,
        alpha: Use,
        block: PluginBlock,
        name: &str,
    ) -> Fallible<PluginBlock> {
        let cutoff = match m.get("alphaMode").and_then(Value::as_str) {
            None | Some("OPAQUE") => return Ok(block),
            Some("BLEND") => None,
            // Alpha is at most 1.
            Some("MASK") => Some(number(m, "alphaCutoff", 0.5, [0.0, 1e30])?),
            Some(other) => return Err(format!("alphaMode: {other:?} is none")),
        };
        let info = pbr.get("baseColorTexture");
        let texture = self.texture(info, name, "opacity", alpha)?;
        let alpha = alpha.scale[0];
        let there = alpha == 1.0 && cutoff.is_none_or(|c| c <= 1.0);
        if texture.is_none() && there {
            return Ok(block);
        }
        let mut mask = PluginBlock::new("mask").with("bsdf", block);
        mask = match cutoff {
            // Nothing is as opaque as that.
            Some(c) if c > 1.0 => return Ok(mask.with("opacity", 0.0)),
            Some(c) => mask.with("cutoff", c),
            None => mask,
        };
        Ok(mask.with("opacity", either(texture, alpha.into())))
    }

    /// A parameter that is a factor times a channel of a texture; the texture of a factor 0 is not needed.
    fn scaled(
        &mut self,
        block: PluginBlock,
        info: Option<&Value>,
        name: &str,
        parameter: &str,
        factor: f64,
        channel: TextureChannel,
    ) -> Fallible<PluginBlock> {
        let info = info.filter(|_| factor > 0.0);
        let texture = self.texture(info, name, parameter, data(channel, factor))?;
        Ok(block.with(parameter, either(texture, factor.into())))
    }

    /// The texture of a `textureInfo`, as a texture of the scene; its name.
    fn texture(
        &mut self,
        info: Option<&Value>,
        name: &str,
        role: &str,
        setup: Use,
    ) -> Fallible<Option<String>> {
        let Some(info) = info else {
            if !setup.vertex_color {
                return Ok(None);
            }
            let mut out = Texture::new(ImageSource::White);
            out.vertex_color = true;
            (out.channel, out.scale) = (setup.channel, setup.scale);
            let name = format!("{name} {role}");
            self.textures.insert(name.clone(), out);
            return Ok(Some(name));
        };
        let at = index(info, "index")?.ok_or("a texture has no index")?;
        let texture = element(self.raw, "textures", at)
            .ok_or_else(|| format!("textures[{at}] does not exist"))?;
        let Some(source) = index(texture, "source")? else {
            self.warn(
                &format!("textures[{at}]"),
                "has no image of a kind that is read",
            );
            return Ok(None);
        };
        let image = self.images.get(source).cloned();
        let image = image.ok_or_else(|| format!("images[{source}] does not exist"))??;
        let sampler = index(texture, "sampler")?
            .and_then(|i| element(self.raw, "samplers", i))
            .unwrap_or(&Value::Null);
        let wrap = |key: &str| match sampler.get(key).and_then(Value::as_u64) {
            Some(33_071) => Wrap::Clamp,
            Some(33_648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let nearest = sampler.get("magFilter").and_then(Value::as_u64) == Some(9728);
        let mut out = Texture::new(image);
        out.color_space = setup.space;
        out.vertex_color = setup.vertex_color;
        out.wrap = [wrap("wrapS"), wrap("wrapT")];
        out.filter = if nearest {
            TextureFilter::Nearest
        } else {
            TextureFilter::Bilinear
        };
        out.channel = setup.channel;
        out.scale = setup.scale;
        out.bias = [setup.bias; 3];
        if let Some(t) = extension(info, "KHR_texture_transform") {
            out.uv = uv_transform(
                numbers(t, "offset", [0.0; 2], [-1e18, 1e18])?,
                number(t, "rotation", 0.0, [-1e4, 1e4])?,
                numbers(t, "scale", [1.0; 2], [-1e18, 1e18])?,
            );
        }
        let name = format!("{name} {role}");
        self.textures.insert(name.clone(), out);
        Ok(Some(name))
    }

    /// The set of coordinates of the material's first texture; others that differ are warned about.
    fn uv_set(&mut self, m: &Value, pbr: &Value, name: &str) -> u32 {
        let mut infos = Vec::new();
        collect_infos(pbr, &mut infos);
        collect_infos(m, &mut infos);
        let set = |info: &Value| {
            let moved = extension(info, "KHR_texture_transform").and_then(|t| t.get("texCoord"));
            let own = moved.or_else(|| info.get("texCoord"));
            own.and_then(Value::as_u64).unwrap_or(0)
        };
        let first = infos.first().map_or(0, |i| set(i));
        if infos.iter().any(|i| set(i) != first) {
            self.warn(
                "texCoord",
                &format!(
                    "textures of '{name}' use several sets of coordinates; set {first} serves all"
                ),
            );
        }
        u32::try_from(first).unwrap_or(0)
    }

    pub fn warn(&mut self, what: &str, why: &str) {
        let text = format!("{what}: {why}");
        if self.warned.insert(text.clone()) {
            self.warnings.push(text);
        }
    }
}

/// Every `textureInfo` of a material: an object under a key that ends in `Texture`. Only objects of known depth are looked into.
fn collect_infos<'v>(v: &'v Value, out: &mut Vec<&'v Value>) {
    for (key, value) in v.as_object().into_iter().flatten() {
        if key.ends_with("Texture") {
            out.push(value);
        } else if key == "extensions" {
            for e in value.as_object().into_iter().flatten() {
                let infos = e.1.as_object().into_iter().flatten();
                out.extend(
                    infos
                        .filter(|(k, _)| k.ends_with("Texture"))
                        .map(|(_, v)| v),
                );
            }
        }
    }
}

fn either(texture: Option<String>, constant: Param) -> Param {
    texture.map_or(constant, Param::Texture)
}

/// From KHR_texture_transform, whose v runs down from the top of the image, to the scene's, whose v runs up.
///
/// With M = T(offset) R S of glTF, where u' = u cos + v sin and v' = v cos − u sin, and F (u, v) = (u, 1 − v), the map is F M F;
/// it turns by the same angle, seen upright.
pub(crate) fn uv_transform(offset: [f64; 2], rotation: f64, scale: [f64; 2]) -> UvTransform {
    let (sin, cos) = rotation.sin_cos();
    UvTransform {
        scale,
        rotation_deg: rotation.to_degrees(),
        offset: [offset[0] + sin * scale[1], 1.0 - offset[1] - cos * scale[1]],
    }
}
