//! The `message!` macro, and definition text made from the same declarations.

use crate::{Interface, Message};
use std::borrow::Cow;
use std::fmt::{self, Write};

/// Collects the definitions of a message and of the messages in it, each once, in order of first use.
#[derive(Debug)]
pub struct Definitions {
    interface: Interface,
    seen: Vec<(&'static str, String)>,
}

impl Definitions {
    /// The interface whose fields are listed.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// Adds `type_name` unless it is known; true if it was new.
    pub(crate) fn add(
        &mut self,
        type_name: &'static str,
        fields: impl FnOnce(&mut String) -> fmt::Result,
    ) -> bool {
        if self.seen.iter().any(|(name, _)| *name == type_name) {
            return false;
        }
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = fields(&mut text);
        self.seen.push((type_name, text));
        true
    }
}

/// `package/Name` of `package/msg/Name`, the form used inside definitions.
pub(crate) fn short_name(type_name: &str) -> Cow<'static, str> {
    Cow::Owned(type_name.replacen("/msg/", "/", 1))
}

pub(crate) fn definition_text<M: Message>(interface: Interface) -> String {
    let mut definitions = Definitions { interface, seen: Vec::new() };
    M::collect_definitions(&mut definitions);
    let mut text = String::new();
    for (index, (name, fields)) in definitions.seen.iter().enumerate() {
        if index > 0 {
            let _ = write!(text, "{}\nMSG: {}\n", "=".repeat(80), short_name(name));
        }
        text.push_str(fields);
    }
    text
}

/// Declares a message: fields in wire order, optionally constants, optionally fields that only newer interfaces have
/// (`#[since(V0_53)]`) and a ROS type that differs from the Rust one (`as "byte"`). A message of primitives alone whose
/// sequences are long may say how many bytes it takes where nothing has to be aligned (`in blocks of 56`), if these are
/// a multiple of eight: its sequences are then read faster.
macro_rules! message {
    (
        $(#[$meta:meta])*
        $name:ident = $type_name:literal $(in blocks of $block:literal)? {
            $($(#[doc = $fdoc:literal])* $(#[since($since:ident)])? $field:ident: $ftype:ty $(as $fname:literal)?,)*
        }
        $(constants {
            $($(#[doc = $cdoc:literal])* $constant:ident: $ctype:ty = $cvalue:literal,)*
        })?
    ) => {
        $(#[$meta])*
        #[doc = ""]
        #[doc = concat!("ROS type `", $type_name, "`.")]
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[doc = $fdoc])* pub $field: $ftype,)*
        }

        impl $name {
            $($($(#[doc = $cdoc])* pub const $constant: $ctype = $cvalue;)*)?
        }

        impl $crate::Message for $name {
            const TYPE_NAME: &'static str = $type_name;
        }

        impl $crate::cdr::Cdr for $name {
            const MIN_BYTES: usize =
                0 $(+ message!(@min_bytes $ftype $(, $since)?))*;

            #[inline]
            fn encode(&self, writer: &mut $crate::cdr::Writer) {
                $(message!(@if_present writer $($since)? => {
                    $crate::cdr::Cdr::encode(&self.$field, writer);
                });)*
            }

            #[inline(always)]
            fn decode(
                reader: &mut $crate::cdr::Reader<'_>,
            ) -> Result<Self, $crate::cdr::DecodeErrorKind> {
                Ok(Self { $($field: message!(@decode reader $($since)?),)* })
            }

            $(fn decode_many(
                reader: &mut $crate::cdr::Reader<'_>,
                count: usize,
            ) -> Result<Vec<Self>, $crate::cdr::DecodeErrorKind> {
                reader.take_blocks::<$block, Self>(count)
            })?

            fn definition_name() -> std::borrow::Cow<'static, str> {
                $crate::define::short_name($type_name)
            }

            fn collect_definitions(definitions: &mut $crate::define::Definitions) {
                let interface = definitions.interface();
                let is_new = definitions.add($type_name, |text| {
                    use std::fmt::Write;
                    let _ = interface;
                    $($(writeln!(
                        text,
                        "{} {}={}",
                        <$ctype as $crate::cdr::Cdr>::definition_name(), stringify!($constant), $cvalue
                    )?;)*)?
                    $(message!(@if_defined interface $($since)? => {
                        writeln!(text, "{} {}", message!(@field_name $ftype $(, $fname)?), stringify!($field).trim_start_matches("r#"))?;
                    });)*
                    Ok(())
                });
                if is_new {
                    $(message!(@if_defined interface $($since)? => {
                        <$ftype as $crate::cdr::Cdr>::collect_definitions(definitions);
                    });)*
                }
            }
        }

        #[cfg(test)]
        impl $crate::cdr::tests::Sample for $name {
            fn sample(random: &mut $crate::cdr::tests::Random) -> Self {
                Self { $($field: $crate::cdr::tests::Sample::sample(random),)* }
            }
        }
    };
    // A field that an interface lacks takes no bytes there.
    (@min_bytes $ftype:ty) => { <$ftype as $crate::cdr::Cdr>::MIN_BYTES };
    (@min_bytes $ftype:ty, $since:ident) => { 0 };
    (@if_present $writer:ident => $body:block) => { $body };
    (@if_present $writer:ident $since:ident => $body:block) => {
        if $writer.interface() == $crate::Interface::$since $body
    };
    (@if_defined $interface:ident => $body:block) => { $body };
    (@if_defined $interface:ident $since:ident => $body:block) => {
        if $interface == $crate::Interface::$since $body
    };
    (@decode $reader:ident) => { $crate::cdr::Cdr::decode($reader)? };
    (@decode $reader:ident $since:ident) => {
        if $reader.interface() == $crate::Interface::$since {
            $crate::cdr::Cdr::decode($reader)?
        } else {
            Default::default()
        }
    };
    (@field_name $ftype:ty) => { <$ftype as $crate::cdr::Cdr>::definition_name() };
    (@field_name $ftype:ty, $fname:literal) => { $fname };
}

pub(crate) use message;
