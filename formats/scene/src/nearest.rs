//! "Did you mean …?": the known name nearest to an unknown one.

/// The edit distance in which a swap of two neighbouring letters counts as one edit (optimal string
/// alignment: Damerau 1964, restricted to letters edited once).
fn distance(a: &[char], b: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let substitute = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = substitute.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

/// The known name nearest to `name`, if one is near enough to be meant: at most a third of its
/// letters differ, or one is a part of the other. Upper and lower case count as equal, and so do
/// `-` and `_`.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let fold = |s: &str| -> Vec<char> {
        s.chars()
            .flat_map(char::to_lowercase)
            .map(|c| if c == '-' { '_' } else { c })
            .collect()
    };
    // A name much longer than any known one is near to none of them, and would cost its square.
    if name.len() > 256 {
        return None;
    }
    let wanted = fold(name);
    known
        .into_iter()
        .filter_map(|k| {
            let letters = fold(k);
            let d = distance(&wanted, &letters);
            let part = |long: &[char], short: &[char]| {
                short.len() >= 3 && long.windows(short.len()).any(|w| w == short)
            };
            let near = 3 * d <= wanted.len().max(letters.len())
                || (d == 1 && wanted.len() > 1)
                || part(&wanted, &letters)
                || part(&letters, &wanted);
            near.then_some((d, k))
        })
        .min_by_key(|(d, _)| *d)
        .map(|(_, k)| k)
}

/// `; did you mean "…"?` for a near name, otherwise the list of all known names.
pub(crate) fn hint<'a>(name: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> String {
    if let Some(near) = nearest(name, known.clone()) {
        return format!("; did you mean {near:?}?");
    }
    let all: Vec<String> = known.into_iter().map(|k| format!("{k:?}")).collect();
    match all.len() {
        0 => "; none is known here".into(),
        1..=24 => format!("; known: {}", all.join(", ")),
        n => format!("; {n} others are known"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_was_meant() {
        let known = ["radiance", "irradiance", "radius", "to_light"];
        assert_eq!(nearest("radiace", known), Some("radiance"));
        assert_eq!(nearest("raidus", known), Some("radius"));
        assert_eq!(nearest("To-Light", known), Some("to_light"));
        assert_eq!(nearest("fov", ["fov_x_deg", "origin"]), Some("fov_x_deg"));
        assert_eq!(nearest("colour", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest(&"r".repeat(1 << 20), known), None);
    }

    #[test]
    fn distances_are_the_textbook_ones() {
        let d = |a: &str, b: &str| {
            distance(
                &a.chars().collect::<Vec<_>>(),
                &b.chars().collect::<Vec<_>>(),
            )
        };
        assert_eq!(d("kitten", "sitting"), 3);
        assert_eq!(d("", "abc"), 3);
        assert_eq!(d("abcd", "abdc"), 1);
        assert_eq!(d("ca", "abc"), 3);
    }
}
