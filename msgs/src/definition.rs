//! Reads the text of a `.msg` file.

/// How many values a field holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Arity {
    /// `T`.
    One,
    /// `T[n]`.
    Array(usize),
    /// `T[]`.
    Sequence,
    /// `T[<=n]`.
    BoundedSequence(usize),
}

/// A field of a message.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Field<'text> {
    /// The type of one element, without the bound of a string.
    pub(crate) element: &'text str,
    /// The most characters that a string may have.
    pub(crate) longest: Option<u64>,
    pub(crate) arity: Arity,
    pub(crate) name: &'text str,
    pub(crate) default: Option<&'text str>,
}

/// Fields and constants of a message, in the order of its text.
#[derive(PartialEq, Eq, Debug, Default)]
pub(crate) struct Definition<'text> {
    pub(crate) fields: Vec<Field<'text>>,
    /// Type, name and value.
    pub(crate) constants: Vec<(&'text str, &'text str, &'text str)>,
}

impl<'text> Definition<'text> {
    /// # Errors
    /// With the line that is neither a field nor a constant.
    pub(crate) fn parse(text: &'text str) -> Result<Self, String> {
        let mut definition = Self::default();
        for line in text.lines() {
            let code = line.split('#').next().unwrap_or_default().trim();
            if code.is_empty() {
                continue;
            }
            let malformed = || format!("neither a field nor a constant: {line}");
            let (kind, rest) = code.split_once(char::is_whitespace).ok_or_else(malformed)?;
            let rest = rest.trim();
            if let Some((name, value)) = rest.split_once('=') {
                definition.constants.push((kind, name.trim(), value.trim()));
                continue;
            }
            let (name, default) = match rest.split_once(char::is_whitespace) {
                Some((name, default)) => (name, Some(default.trim())),
                None => (rest, None),
            };
            let (kind, arity) = kind_and_arity(kind).ok_or_else(malformed)?;
            let (element, longest) = match kind.split_once("<=") {
                None => (kind, None),
                Some((element, most)) => (element, Some(most.parse().map_err(|_| malformed())?)),
            };
            definition.fields.push(Field { element, longest, arity, name, default });
        }
        Ok(definition)
    }
}

fn kind_and_arity(kind: &str) -> Option<(&str, Arity)> {
    let (element, arity) = match kind.split_once('[') {
        None => (kind, Arity::One),
        Some((element, bounds)) => {
            let bounds = bounds.strip_suffix(']')?;
            let arity = match bounds.strip_prefix("<=") {
                Some(most) => Arity::BoundedSequence(most.parse().ok()?),
                None if bounds.is_empty() => Arity::Sequence,
                None => Arity::Array(bounds.parse().ok()?),
            };
            (element, arity)
        }
    };
    Some((element, arity))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_constants_defaults_and_bounds_are_read() {
        let text = "# head\nuint8 A=1 # one\nint32 B = -2\n\nstring<=5 name \"x\"\n\
                    float64[36] c\nPoint[] p # points\nstring<=4[<=3] s\nfloat64 w 1\n";
        let field = |element, arity, name, default| Field {
            element,
            longest: match name {
                "name" => Some(5),
                "s" => Some(4),
                _ => None,
            },
            arity,
            name,
            default,
        };
        assert_eq!(
            Definition::parse(text).unwrap(),
            Definition {
                fields: vec![
                    field("string", Arity::One, "name", Some("\"x\"")),
                    field("float64", Arity::Array(36), "c", None),
                    field("Point", Arity::Sequence, "p", None),
                    field("string", Arity::BoundedSequence(3), "s", None),
                    field("float64", Arity::One, "w", Some("1")),
                ],
                constants: vec![("uint8", "A", "1"), ("int32", "B", "-2")],
            }
        );
        assert!(Definition::parse("float64\n").is_err());
        assert!(Definition::parse("float64[x] y\n").is_err());
    }
}
