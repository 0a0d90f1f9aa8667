//! Makes plugin instances from JSON parameters, as a program does, but without one.

use core::ffi::c_void;
use resolvent_api::abi::{
    BsdfTable, CreateArgs, HostTable, ParamDecl, ParamKind, ParamValue, PluginHeader, Task, Text,
    param_flags,
};
use resolvent_api::export::{BsdfShim, header};
use resolvent_api::{Affine, Bsdf, Params, Plugin, PluginKind};
use serde_json::Value;

/// An instance of `T` with the given parameters (a JSON object), three lanes and no transform. A texturable parameter may be
/// `{"texture": "uv"}`, whose red, green, blue and alpha are u, v, 0 and 1.
///
/// # Errors
/// If a parameter is unknown, missing, mistyped or out of range, or the plugin refuses.
pub fn create<T: Plugin>(params: &str) -> Result<T, String> {
    create_at(params, &Affine::IDENTITY)
}

/// As [`create`], placed by `to_world`.
///
/// # Errors
/// As [`create`].
pub fn create_at<T: Plugin>(params: &str, to_world: &Affine) -> Result<T, String> {
    with_args::<T, _>(params, to_world, &[], |args| {
        // SAFETY: the arguments are valid for the call.
        T::create(&unsafe { Params::new(args) }).map_err(|e| e.0)
    })
}

/// As [`create`], with BSDFs nested in it: the parameters of those names.
///
/// # Errors
/// As [`create`].
pub fn create_with<T: Plugin>(params: &str, nested: &[(&str, Nested)]) -> Result<T, String> {
    with_args::<T, _>(params, &Affine::IDENTITY, nested, |args| {
        // SAFETY: the arguments are valid for the call.
        T::create(&unsafe { Params::new(args) }).map_err(|e| e.0)
    })
}

/// An instance to be nested in another. It is never destroyed: tests end soon enough.
#[derive(Clone, Copy)]
pub struct Nested {
    header: &'static PluginHeader,
    instance: *const c_void,
}

impl Nested {
    /// An instance of the BSDF plugin `T` with BSDFs nested in it, made across the boundary as a host makes it.
    ///
    /// # Errors
    /// As [`create`].
    pub fn bsdf<T: Plugin + Bsdf>(params: &str, nested: &[(&str, Self)]) -> Result<Self, String> {
        let table: &'static BsdfTable = Box::leak(Box::new(BsdfShim::<T>::TABLE));
        let header = header::<T>(PluginKind::Bsdf, "0.0.0", core::ptr::from_ref(table).cast());
        let instance = with_args::<T, _>(params, &Affine::IDENTITY, nested, |args| {
            // SAFETY: the arguments are valid for the call.
            let instance = unsafe { (table.create)(args) };
            if instance.is_null() {
                return Err("the nested BSDF refuses".to_owned());
            }
            Ok(instance)
        })?;
        Ok(Self {
            header: Box::leak(Box::new(header)),
            instance,
        })
    }
}

/// Calls `make` with the arguments that a host would pass to `create`.
fn with_args<T: Plugin, R>(
    params: &str,
    to_world: &Affine,
    nested: &[(&str, Nested)],
    make: impl FnOnce(&CreateArgs) -> Result<R, String>,
) -> Result<R, String> {
    let given: Value = serde_json::from_str(params).map_err(|e| e.to_string())?;
    let given = given.as_object().ok_or("parameters are a JSON object")?;
    // SAFETY: declarations hold static texts.
    let name_of = |d: &ParamDecl| unsafe { d.name.to_owned() };
    if let Some(unknown) = given
        .keys()
        .find(|k| !T::PARAMS.iter().any(|d| name_of(d) == **k))
    {
        return Err(format!("unknown parameter '{unknown}'"));
    }
    let mut held = Vec::new();
    for decl in T::PARAMS {
        let name = name_of(decl);
        if nested.iter().any(|(n, _)| *n == name) {
            held.push((decl.kind, (vec![], String::new()), name));
            continue;
        }
        // SAFETY: as above.
        let default = unsafe { decl.default.to_owned() };
        let value = match given.get(&name) {
            Some(v) => v.clone(),
            None if !default.is_empty() => {
                serde_json::from_str(&default).map_err(|e| format!("default of '{name}': {e}"))?
            }
            None if decl.flags & param_flags::REQUIRED != 0 => {
                return Err(format!("'{name}' is missing"));
            }
            None => continue,
        };
        if value.get("texture").is_some() {
            if decl.flags & param_flags::TEXTURABLE == 0 {
                return Err(format!("'{name}': takes no texture"));
            }
            held.push((ParamKind::Texture as u32, Default::default(), name));
            continue;
        }
        held.push((
            decl.kind,
            read(decl, &value).map_err(|e| format!("'{name}': {e}"))?,
            name,
        ));
    }
    let values: Vec<ParamValue> = held
        .iter()
        .map(|(kind, (numbers, text), name)| {
            let inner = nested.iter().find(|(n, _)| n == name).map(|(_, i)| i);
            ParamValue {
                name: Text::new(name),
                kind: *kind,
                count: numbers.len() as u32,
                numbers: numbers.as_ptr(),
                text: Text::new(text),
                header: inner.map_or(core::ptr::null(), |i| core::ptr::from_ref(i.header)),
                // Any address will do as the handle of the one texture.
                instance: inner.map_or(name.as_ptr().cast(), |i| i.instance),
            }
        })
        .collect();
    let args = CreateArgs {
        size: size_of::<CreateArgs>() as u32,
        param_count: values.len() as u32,
        params: values.as_ptr(),
        host: &raw const HOST,
        to_world: to_world.to_rows(),
        lanes: 3,
        reserved: 0,
    };
    make(&args)
}

/// Numbers and text of a value, checked against its declaration.
fn read(decl: &ParamDecl, value: &Value) -> Result<(Vec<f64>, String), String> {
    let is = |kind: ParamKind| decl.kind == kind as u32;
    let mut numbers: Vec<f64> = match value {
        Value::Number(n) => n.as_f64().into_iter().collect(),
        Value::Bool(b) => vec![f64::from(u8::from(*b))],
        Value::Array(a) => a.iter().filter_map(Value::as_f64).collect(),
        _ => vec![],
    };
    if is(ParamKind::Text) || is(ParamKind::File) || is(ParamKind::Choice) {
        let text = value.as_str().ok_or("not a text")?;
        // SAFETY: declarations hold static texts.
        let choices = unsafe { decl.choices.to_owned() };
        if is(ParamKind::Choice) && !choices.split('|').any(|c| c == text) {
            return Err(format!("'{text}' is none of {choices}"));
        }
        return Ok((vec![], text.into()));
    }
    if is(ParamKind::Spectrum) && numbers.len() == 1 {
        numbers = vec![numbers[0]; 3];
    }
    let count_fits = match numbers.len() {
        _ if is(ParamKind::Numbers) => value.is_array(),
        1 => is(ParamKind::Bool) == value.is_boolean() && !is(ParamKind::Vec3),
        3 => is(ParamKind::Spectrum) || is(ParamKind::Vec3),
        _ => false,
    };
    if !count_fits {
        return Err(format!("{value} is not of the declared type"));
    }
    let has = |flag: u32| decl.flags & flag != 0;
    for &v in &numbers {
        let low = has(param_flags::MIN)
            && (v < decl.min || (has(param_flags::ABOVE_MIN) && v <= decl.min));
        let high = has(param_flags::MAX)
            && (v > decl.max || (has(param_flags::BELOW_MAX) && v >= decl.max));
        if low || high || (is(ParamKind::Int) && v.fract() != 0.0) {
            return Err(format!("{v} is out of range"));
        }
    }
    Ok((numbers, String::new()))
}

unsafe extern "C" fn ignore_log(_: *mut c_void, _: u32, _: Text) {}

unsafe extern "C" fn ignore_fail(_: *mut c_void, _: Text) {}

unsafe extern "C" fn one_by_one(_: *mut c_void, count: usize, task: Task, data: *const c_void) {
    for i in 0..count {
        // SAFETY: the caller promises that `task` may be called with `data` for every index below `count`.
        unsafe { task(data, i) };
    }
}

/// The one texture there is: (u, v) themselves, and 0 and 1.
unsafe extern "C" fn coordinates(
    _: *mut c_void,
    _: *const c_void,
    uv: *const [f32; 2],
    out: *mut [f32; 4],
) {
    // SAFETY: the caller passes valid pointers.
    unsafe { *out = [(*uv)[0], (*uv)[1], 0.0, 1.0] };
}

/// The same, asked with a point.
unsafe extern "C" fn coordinates_at(
    ctx: *mut c_void,
    texture: *const c_void,
    at: *const resolvent_api::SurfacePoint,
    out: *mut [f32; 4],
) {
    // SAFETY: as above.
    unsafe { coordinates(ctx, texture, &(*at).uv, out) };
}

static HOST: HostTable = HostTable {
    size: size_of::<HostTable>() as u32,
    abi_minor: resolvent_api::abi::ABI_MINOR,
    ctx: core::ptr::null_mut(),
    log: ignore_log,
    fail: ignore_fail,
    parallel_for: one_by_one,
    texture: coordinates,
    texture_at: coordinates_at,
};

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::{Decl, Error};

    #[derive(Debug, PartialEq)]
    struct Probe(f64, Vec<f64>, String, bool);

    impl Plugin for Probe {
        const NAME: &'static str = "probe";
        const SUMMARY: &'static str = "For the tests of this file.";
        const PARAMS: &'static [ParamDecl] = &[
            Decl::float("x", "")
                .default("0.5")
                .above(0.0)
                .at_most(1.0)
                .build(),
            Decl::spectrum("c", "").required().at_least(0.0).build(),
            Decl::choice("kind", "a|b", "").default("\"a\"").build(),
            Decl::int("n", "").build(),
        ];
        fn create(p: &Params<'_>) -> Result<Self, Error> {
            let c = p.spectrum("c").ok_or_else(|| Error::new("no c"))?;
            let c = c.to_rgb().map(f64::from).to_vec();
            let kind = p.text("kind").ok_or_else(|| Error::new("no kind"))?;
            p.host().parallel_for(3, |i| assert!(i < 3));
            Ok(Self(p.float("x")?, c, kind, p.int("n").is_ok()))
        }
    }

    #[test]
    fn defaults_and_values_arrive() {
        let p = create::<Probe>(r#"{ "c": 2, "n": 4 }"#).unwrap();
        assert_eq!(p, Probe(0.5, vec![2.0; 3], "a".into(), true));
        let p = create::<Probe>(r#"{ "c": [1, 2, 3], "kind": "b", "x": 1 }"#).unwrap();
        assert_eq!(p, Probe(1.0, vec![1.0, 2.0, 3.0], "b".into(), false));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        for bad in [
            r#"{}"#,
            r#"{ "c": 1, "y": 1 }"#,
            r#"{ "c": -1 }"#,
            r#"{ "c": [1, 2] }"#,
            r#"{ "c": 1, "x": 0 }"#,
            r#"{ "c": 1, "x": "1" }"#,
            r#"{ "c": 1, "kind": "c" }"#,
            r#"{ "c": 1, "n": 1.5 }"#,
        ] {
            assert!(create::<Probe>(bad).is_err(), "{bad}");
        }
    }
}
