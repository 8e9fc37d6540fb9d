//! Enums whose values have names, as typed and as printed.

use std::str::FromStr;

/// An enum whose values have names.
pub trait Named: FromStr<Err = UnknownName> + Clone + Send + Sync + 'static {
    /// What a value is, in words.
    const WHAT: &'static str;

    /// All names, in the order of the help text.
    fn names() -> impl Iterator<Item = &'static str>;
}

/// A name that no value of its enum has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no {what} is named {name:?}; there are: {names}")]
pub struct UnknownName {
    what: &'static str,
    name: String,
    names: String,
}

impl UnknownName {
    /// Error for a name that no `T` has.
    pub fn of<T: Named>(name: &str) -> Self {
        Self { what: T::WHAT, name: name.into(), names: T::names().collect::<Vec<_>>().join(", ") }
    }
}

/// Names every value of an `enum`, in the order of the help text, after a word for what a value is. Generates `ALL`, parsing
/// and printing.
macro_rules! names {
    ($kind:ident, $what:literal, $($value:ident => $name:literal),+ $(,)?) => {
        impl $kind {
            /// Every value, in the order of the help text.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$value),+];

            /// Name as typed and printed.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$value => $name),+ }
            }
        }

        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $kind {
            type Err = $crate::named::UnknownName;

            fn from_str(name: &str) -> Result<Self, Self::Err> {
                let known = Self::ALL.into_iter().find(|one| one.name() == name);
                known.ok_or_else(|| $crate::named::UnknownName::of::<Self>(name))
            }
        }

        impl $crate::named::Named for $kind {
            const WHAT: &'static str = $what;

            fn names() -> impl Iterator<Item = &'static str> {
                Self::ALL.into_iter().map(Self::name)
            }
        }
    };
}

pub(crate) use names;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{AccelChoice, AccelKind, Assign, IntersectorKind, MailboxKind};
    use crate::generate::Family;
    use crate::image::ToneMap;
    use crate::render::{Cost, Filter, Instancing, Quality, Split};
    use crate::scene::framing::NamedView;
    use std::fmt::Display;

    fn are_read_back<T: Named + Display>() {
        assert!(T::names().count() > 1, "{}", T::WHAT);
        for name in T::names() {
            assert_eq!(name.parse::<T>().map(|one| one.to_string()), Ok(name.into()));
        }
        let error = "gird".parse::<T>().map(|one| one.to_string()).unwrap_err().to_string();
        assert!(error.starts_with("no ") && error.contains(" is named \"gird\"; there are: "), "{error}");
    }

    #[test]
    fn every_name_of_every_kind_is_read_back() {
        are_read_back::<AccelKind>();
        are_read_back::<AccelChoice>();
        are_read_back::<Assign>();
        are_read_back::<Cost>();
        are_read_back::<Family>();
        are_read_back::<Filter>();
        are_read_back::<Instancing>();
        are_read_back::<IntersectorKind>();
        are_read_back::<MailboxKind>();
        are_read_back::<NamedView>();
        are_read_back::<Quality>();
        are_read_back::<Split>();
        are_read_back::<ToneMap>();
    }

    #[test]
    fn what_no_value_is_named_is_told_with_all_names() {
        let error = "lossy".parse::<MailboxKind>().map_err(|e| e.to_string());
        assert_eq!(error, Err("no mailbox is named \"lossy\"; there are: none, exact, hashed".into()));
    }
}
