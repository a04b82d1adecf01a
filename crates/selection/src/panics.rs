//! Keeps a panic where it happened.
//!
//! What it promises: whatever the called code does with a panic, its text comes back as a value; not even what is thrown
//! can panic again when it is dropped.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What the call gives, or the text of the panic that ended it. The caller answers for what the call has left half done.
///
/// # Errors
/// The call panicked.
pub fn caught<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|thrown| {
        let text = text_of(thrown.as_ref());
        if let Err(again) = catch_unwind(AssertUnwindSafe(|| drop(thrown))) {
            // Dropping this one might go on for ever.
            #[expect(clippy::mem_forget, reason = "a few bytes are the price of not panicking again")]
            std::mem::forget(again);
        }
        text
    })
}

fn text_of(thrown: &(dyn Any + Send)) -> String {
    let text = thrown.downcast_ref::<&str>().copied();
    text.or_else(|| thrown.downcast_ref::<String>().map(String::as_str)).unwrap_or("no text").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::resume_unwind;

    #[test]
    fn texts_of_panics() {
        assert_eq!(caught(|| 3), Ok(3));
        assert_eq!(caught(|| resume_unwind(Box::new("plain"))), Err::<(), _>("plain".to_owned()));
        assert_eq!(caught(|| resume_unwind(Box::new(format!("{}", 7)))), Err::<(), _>("7".to_owned()));
        assert_eq!(caught(|| resume_unwind(Box::new(7))), Err::<(), _>("no text".to_owned()));
    }

    /// Panics when it is dropped, with another of its kind.
    struct Bomb;

    impl Drop for Bomb {
        fn drop(&mut self) {
            resume_unwind(Box::new(Self));
        }
    }

    #[test]
    fn what_is_thrown_may_panic_when_it_is_dropped() {
        assert_eq!(caught(|| resume_unwind(Box::new(Bomb))), Err::<(), _>("no text".to_owned()));
    }
}
