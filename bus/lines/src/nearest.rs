//! Finds the word that a mistyped one stands for: the most similar of the known words.
//!
//! Only error sentences use it. No program acts on a guess.

/// The candidate that is most similar to `word`, if one is similar enough: at most a third of the
/// longer word's letters, and at least one, may be changed, added, left out or exchanged with the
/// next letter. Of equally similar ones the first counts. Upper and lower case count as equal.
///
/// ```
/// use lager_lines::nearest;
///
/// assert_eq!(nearest("sied", ["id", "name", "square", "side"]), Some("side"));
/// assert_eq!(nearest("nav/statsu", ["nav/route", "nav/status"]), Some("nav/status"));
/// assert_eq!(nearest("colour", ["id", "name", "square", "side"]), None);
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let letters = |word: &str| word.to_lowercase().chars().collect::<Vec<_>>();
    let word = letters(word);
    let near = candidates.into_iter().filter_map(|candidate| {
        let other = letters(candidate);
        let most = (word.len().max(other.len()) / 3).max(1);
        let distance = distance(&word, &other);
        // A word without letters would be similar to every other.
        let is_like = distance <= most && distance < word.len().max(other.len());
        is_like.then_some((distance, candidate))
    });
    // Of equal ones `min_by_key` takes the first.
    near.min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// The right name, if a serde error says that a name is unknown and lists the known ones.
///
/// ```
/// let why = "unknown field `sied`, expected one of `id`, `square`, `side`";
/// assert_eq!(lager_lines::meant(why), Some("side"));
/// assert_eq!(lager_lines::meant("invalid type: string"), None);
/// ```
pub fn meant(message: &str) -> Option<&str> {
    let (_, names) = message
        .split_once("unknown field `")
        .or_else(|| message.split_once("unknown variant `"))?;
    // The error quotes the typed name and the known names between marks.
    let mut quoted = names.split('`').step_by(2);
    let typed = quoted.next()?;
    nearest(typed, quoted)
}

/// The end of such an error: `; did you mean `side`?`, or nothing if no known name is similar.
pub fn hint(message: &str) -> String {
    meant(message).map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"))
}

/// How many letters differ: changed, added, left out, or exchanged with the next one.
fn distance(from: &[char], to: &[char]) -> usize {
    // Three rows of the table are enough: an exchange looks back over two.
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, b) in to.iter().enumerate() {
            let changed = last[j] + usize::from(a != b);
            let mut least = changed.min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && from[i - 1] == *b && *a == to[j - 1] {
                least = least.min(before_last[j - 1] + 1);
            }
            row.push(least);
        }
        before_last = core::mem::replace(&mut last, row);
    }
    last[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_word_finds_the_one_that_was_meant() {
        let keys = ["size", "side_length_cm", "delivery", "product"];
        for (typed, meant) in [
            ("products", Some("product")),
            ("Product", Some("product")),
            ("delivrey", Some("delivery")),
            ("side_length", Some("side_length_cm")),
            ("siez", Some("size")),
            ("exit", None),
            ("", None),
        ] {
            assert_eq!(nearest(typed, keys), meant, "{typed}");
        }
    }

    #[test]
    fn nothing_is_like_a_word_of_which_nothing_is_left() {
        assert_eq!(nearest("x", ["y"]), None);
        assert_eq!(nearest("x", ["x"]), Some("x"));
        assert_eq!(nearest("smal", ["small", "large"]), Some("small"));
    }

    #[test]
    fn an_exchange_counts_once() {
        let letters = |word: &str| word.chars().collect::<Vec<_>>();
        assert_eq!(distance(&letters("sied"), &letters("side")), 1);
        assert_eq!(distance(&letters(""), &letters("side")), 4);
        assert_eq!(distance(&letters("kitten"), &letters("sitting")), 3);
    }
}
