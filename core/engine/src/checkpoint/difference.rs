//! What differs between two JSON values.

use serde_json::Value;

/// Where two values differ first, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Such as `scene.lights[0].irradiance`.
    pub place: String,
    /// What the first has there.
    pub first: String,
    /// What the second has there.
    pub second: String,
}

/// Where `first` and `second` differ first.
pub fn difference(first: &Value, second: &Value) -> Option<Difference> {
    find(first, second, String::new())
}

fn find(a: &Value, b: &Value, place: String) -> Option<Difference> {
    match (a, b) {
        (Value::Object(m), Value::Object(n)) => {
            let keys = m.keys().chain(n.keys().filter(|k| !m.contains_key(*k)));
            for key in keys {
                let dot = if place.is_empty() { "" } else { "." };
                let (x, y) = (m.get(key), n.get(key));
                let none = &Value::Null;
                let inner = format!("{place}{dot}{key}");
                if let Some(d) = find(x.unwrap_or(none), y.unwrap_or(none), inner) {
                    return Some(d);
                }
            }
            None
        }
        (Value::Array(m), Value::Array(n)) if m.len() == n.len() => m
            .iter()
            .zip(n)
            .enumerate()
            .find_map(|(i, (x, y))| find(x, y, format!("{place}[{i}]"))),
        _ if a == b => None,
        _ => Some(Difference {
            place,
            first: short(a),
            second: short(b),
        }),
    }
}

/// A value in a message.
fn short(v: &Value) -> String {
    const LONGEST: usize = 80;
    let text = match v {
        Value::Null => return "nothing".into(),
        Value::String(s) => s.clone(),
        other => other.to_string(),
    };
    if text.chars().count() <= LONGEST {
        return text;
    }
    let head: String = text.chars().take(LONGEST).collect();
    format!("{head}…")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_first_difference_is_named() {
        let a = json!({"seed": 1, "lights": [{"e": [1, 2]}, {"e": 3}], "x": "y"});
        let place = |b: Value| difference(&a, &b).map(|d| (d.place, d.first, d.second));
        let is = |place: &str, a: &str, b: &str| Some((place.into(), a.into(), b.into()));
        assert_eq!(place(a.clone()), None);
        let mut b = a.clone();
        b["lights"][0]["e"][1] = json!(5);
        assert_eq!(place(b), is("lights[0].e[1]", "2", "5"));
        let mut b = a.clone();
        b["new"] = json!(true);
        assert_eq!(place(b), is("new", "nothing", "true"));
        assert_eq!(
            place(json!({"seed": 1, "lights": [], "x": "y"})),
            is("lights", r#"[{"e":[1,2]},{"e":3}]"#, "[]")
        );
    }
}
