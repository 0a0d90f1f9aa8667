//! From a plugin's declarations as they cross the ABI to the scene format's.

use resolvent_api::abi::{self, PluginHeader, PluginKind, Text, param_flags};
use resolvent_scene::{ParamDecl, ParamKind, PluginBlock, PluginDecl, Value};

/// Reads the declarations behind a checked header.
pub(super) fn declaration(header: &PluginHeader, kind: PluginKind) -> Result<PluginDecl, String> {
    let name = text(header.name);
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        return Err(format!(
            "has the name {name:?}; letters, digits, '-' and '_' are allowed"
        ));
    }
    let size = header.param_size as usize;
    if size < size_of::<abi::ParamDecl>() || !size.is_multiple_of(align_of::<abi::ParamDecl>()) {
        return Err(format!(
            "its parameter declarations have {size} bytes each instead of {}",
            size_of::<abi::ParamDecl>()
        ));
    }
    if header.param_count > 0 && (header.params.is_null() || !header.params.is_aligned()) {
        return Err(format!(
            "promises {} parameter declarations and has none",
            header.param_count
        ));
    }
    let mut params = Vec::new();
    for i in 0..header.param_count as usize {
        // SAFETY: the header, checked for magic, version and size, promises `param_count` declarations of `param_size`
        // bytes each, in static memory of a library that stays.
        let raw = unsafe {
            &*header
                .params
                .cast::<u8>()
                .add(i * header.param_size as usize)
                .cast::<abi::ParamDecl>()
        };
        params.push(parameter(raw, kind)?);
    }
    Ok(PluginDecl {
        name,
        kind: kind.name().into(),
        version: text(header.version),
        summary: text(header.summary),
        params,
    })
}

fn text(t: Text) -> String {
    // SAFETY: texts of a checked header point into static memory of a library that stays.
    unsafe { t.to_owned() }
}

fn parameter(raw: &abi::ParamDecl, of: PluginKind) -> Result<ParamDecl, String> {
    let name = text(raw.name);
    let choices = text(raw.choices);
    let kind = match raw.kind {
        k if k == abi::ParamKind::Bool as u32 => ParamKind::Bool,
        k if k == abi::ParamKind::Int as u32 => ParamKind::Int,
        k if k == abi::ParamKind::Float as u32 => ParamKind::Float,
        k if k == abi::ParamKind::Spectrum as u32 => ParamKind::Spectrum,
        k if k == abi::ParamKind::Vec3 as u32 => ParamKind::Vec3,
        k if k == abi::ParamKind::Text as u32 => ParamKind::Text,
        k if k == abi::ParamKind::File as u32 => ParamKind::File,
        k if k == abi::ParamKind::Choice as u32 => {
            ParamKind::Choice(choices.split('|').map(str::to_owned).collect())
        }
        k if k == abi::ParamKind::Numbers as u32 => ParamKind::Numbers,
        k if k == abi::ParamKind::Plugin as u32 => ParamKind::Plugin(choices),
        k => {
            return Err(format!(
                "declares the parameter '{name}' with the unknown type {k}"
            ));
        }
    };
    let json = text(raw.default);
    let default = match json.as_str() {
        "" => None,
        json => Some(
            serde_json::from_str(json)
                .ok()
                .and_then(value)
                .ok_or_else(|| {
                    format!("declares the default {json} of '{name}', which cannot be read")
                })?,
        ),
    };
    let has = |flag: u32| raw.flags & flag != 0;
    let texturable = has(param_flags::TEXTURABLE);
    let varies = matches!(kind, ParamKind::Float | ParamKind::Spectrum);
    if texturable && !(varies && of == PluginKind::Bsdf) {
        return Err(format!(
            "declares that '{name}' may be textured: only numbers and spectra of BSDFs may"
        ));
    }
    Ok(ParamDecl {
        name,
        kind,
        required: has(param_flags::REQUIRED),
        default,
        min: has(param_flags::MIN).then_some(raw.min),
        max: has(param_flags::MAX).then_some(raw.max),
        min_excluded: has(param_flags::ABOVE_MIN),
        max_excluded: has(param_flags::BELOW_MAX),
        texturable,
        unit: text(raw.unit),
        help: text(raw.help),
    })
}

fn value(json: serde_json::Value) -> Option<Value> {
    Some(match json {
        serde_json::Value::Bool(b) => Value::Bool(b),
        serde_json::Value::Number(n) => Value::Number(n.as_f64()?),
        serde_json::Value::String(t) => Value::Text(t),
        serde_json::Value::Array(a) => {
            Value::List(a.into_iter().map(value).collect::<Option<_>>()?)
        }
        serde_json::Value::Object(o) => {
            let mut block = PluginBlock::new(o.get("plugin")?.as_str()?);
            if let Some(params) = o.get("params") {
                for (k, v) in params.as_object()? {
                    block = block.with(k.as_str(), value(v.clone())?);
                }
            }
            Value::Object(block)
        }
        serde_json::Value::Null => return None,
    })
}
