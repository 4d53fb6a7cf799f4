//! Which known name is meant by one that is misspelt.

/// The name that is spelt most like another one; `None` where none is like it.
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let (distance, other) = nearest(name, known)?;
    (distance <= other.len().max(3) / 3).then_some(other)
}

/// The same, if it differs by so many letters at most.
pub fn nearest_name_within<'a>(
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
    most_letters: usize,
) -> Option<&'a str> {
    let as_long =
        known.into_iter().filter(|other| other.len().abs_diff(name.len()) <= most_letters);
    let (distance, other) = nearest(name, as_long)?;
    (distance <= most_letters).then_some(other)
}

fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<(usize, &'a str)> {
    known.into_iter().map(|other| (edit_distance(name, other), other)).min()
}

/// The least number of insertions, deletions and substitutions between two names (Levenshtein).
#[cfg_attr(
    not(test),
    expect(
        clippy::indexing_slicing,
        reason = "the row has a place for each character, and one more"
    )
)]
fn edit_distance(left: &str, right: &str) -> usize {
    let right: Vec<char> = right.chars().collect();
    let mut row: Vec<usize> = (0..=right.len()).collect();
    for (i, one) in left.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in right.iter().enumerate() {
            let substituted = diagonal + usize::from(one != *other);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[right.len()]
}
