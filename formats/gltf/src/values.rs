//! Values of raw JSON, for what the typed form does not have: absent ones have defaults, wrong ones are errors.

use serde_json::Value;

use crate::error::Fallible;

/// A number within a range.
pub(crate) fn number(v: &Value, key: &str, default: f64, range: [f64; 2]) -> Fallible<f64> {
    match v.get(key) {
        None => Ok(default),
        Some(found) => match found.as_f64() {
            Some(x) if x >= range[0] && x <= range[1] => Ok(x),
            _ => Err(format!(
                "{key}: expected a number in [{}, {}], found {found}",
                range[0], range[1]
            )),
        },
    }
}

/// `N` numbers within a range.
pub(crate) fn numbers<const N: usize>(
    v: &Value,
    key: &str,
    default: [f64; N],
    range: [f64; 2],
) -> Fallible<[f64; N]> {
    let Some(found) = v.get(key) else {
        return Ok(default);
    };
    let all: Option<Vec<f64>> = found
        .as_array()
        .and_then(|a| a.iter().map(Value::as_f64).collect());
    let fits = |a: &[f64; N]| a.iter().all(|x| *x >= range[0] && *x <= range[1]);
    all.and_then(|a| <[f64; N]>::try_from(a).ok())
        .filter(fits)
        .ok_or_else(|| {
            format!(
                "{key}: expected {N} numbers in [{}, {}]",
                range[0], range[1]
            )
        })
}

/// A whole number.
pub(crate) fn index(v: &Value, key: &str) -> Fallible<Option<usize>> {
    match v.get(key) {
        None => Ok(None),
        Some(found) => found
            .as_u64()
            .and_then(|i| usize::try_from(i).ok())
            .map(Some)
            .ok_or_else(|| format!("{key}: expected an index, found {found}")),
    }
}

/// Element `index` of the list under `key`.
pub(crate) fn element<'v>(v: &'v Value, key: &str, index: usize) -> Option<&'v Value> {
    v.get(key)?.get(index)
}

/// A name from the file, cut off where it is no name any more: parts of a scene name each other, many of them the same one.
pub(crate) fn short(name: &str) -> String {
    const MOST: usize = 120;
    match name.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.to_owned(),
    }
}

/// The value of an extension.
pub(crate) fn extension<'v>(v: &'v Value, name: &str) -> Option<&'v Value> {
    v.get("extensions")?.get(name)
}
