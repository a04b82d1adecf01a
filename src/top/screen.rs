//! The terminal: taken, drawn on, and given back as it was found - at the end, on errors, signals and panics.
//!
//! Only one thread draws. Another one's panic is told on the board and leaves the terminal alone.

use super::Told;
use super::board::Board;
use super::view::{self, Look};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use std::io::{self, Stdout};
use std::mem::ManuallyDrop;
use std::time::{Duration, Instant};
use std::{panic, thread};

/// The screen is drawn this often.
const FRAME: Duration = Duration::from_millis(100);
/// No more is taken in before the next frame, however much there is.
const MOST_PER_FRAME: usize = 8192;

/// The terminal while it is ours.
#[derive(Debug)]
pub struct Screen(
    // Never dropped: its own drop writes to a standard error that may be gone, and that would be a panic.
    ManuallyDrop<Terminal<CrosstermBackend<Stdout>>>,
);

impl Screen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// It cannot be taken; then it is as it was.
    pub fn open(told: Sender<Told>) -> io::Result<Self> {
        keep_panics_readable(told);
        let opened = enable_raw_mode()
            .and_then(|()| execute!(io::stdout(), EnterAlternateScreen))
            .and_then(|()| Terminal::new(CrosstermBackend::new(io::stdout())));
        match opened {
            Ok(terminal) => Ok(Self(ManuallyDrop::new(terminal))),
            Err(error) => {
                give_back();
                Err(error)
            }
        }
    }

    /// Shows what is told until somebody wants to quit. Gives everything counted.
    ///
    /// # Errors
    /// The terminal is gone.
    pub fn show(
        &mut self,
        source: &str,
        told: &Receiver<Told>,
        wishes: &Receiver<Wish>,
    ) -> io::Result<Board> {
        let began = Instant::now();
        let mut board = Board::default();
        let mut held: Option<(Board, Duration)> = None;
        let mut selected = 0;
        loop {
            for told in told.try_iter().take(MOST_PER_FRAME) {
                board.take(told, began.elapsed());
            }
            let is_paused = held.is_some();
            let (shown, now) = held.as_ref().map_or((&board, began.elapsed()), |(board, at)| (board, *at));
            let look = Look { source, selected, is_paused, now };
            self.0.draw(|frame| view::draw(frame, shown, look))?;
            let generators = shown.rows.len();
            match wishes.recv_timeout(FRAME) {
                Ok(Wish::Quit) | Err(RecvTimeoutError::Disconnected) => return Ok(board),
                Ok(Wish::Hold) => {
                    held = if is_paused { None } else { Some((board.clone(), began.elapsed())) };
                }
                Ok(Wish::Next) => selected = (selected + 1).min(generators.saturating_sub(1)),
                Ok(Wish::Previous) => selected = selected.saturating_sub(1),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }
}

/// Reads keys until the process ends, on a thread of its own: reading from a terminal that is gone may never return.
///
/// # Errors
/// There is no thread.
pub fn listen(wishes: Sender<Wish>) -> io::Result<()> {
    let read = move || {
        while let Ok(event) = event::read() {
            if let Some(wish) = meaning(&event)
                && wishes.send(wish).is_err()
            {
                return;
            }
        }
    };
    thread::Builder::new().name("keys".to_owned()).spawn(read).map(drop)
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
        if !thread::panicking() {
            drop(panic::take_hook());
        }
    }
}

/// What somebody in front of the screen wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// To leave.
    Quit,
    /// The screen to stand still, or to go on.
    Hold,
    /// The next generator.
    Next,
    /// The one before.
    Previous,
}

fn meaning(event: &Event) -> Option<Wish> {
    let Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press, .. }) = event else { return None };
    match code {
        KeyCode::Char('c' | 'd') if modifiers.contains(KeyModifiers::CONTROL) => Some(Wish::Quit),
        KeyCode::Char('q') | KeyCode::Esc => Some(Wish::Quit),
        KeyCode::Char(' ') => Some(Wish::Hold),
        KeyCode::Down | KeyCode::Right | KeyCode::Tab => Some(Wish::Next),
        KeyCode::Up | KeyCode::Left | KeyCode::BackTab => Some(Wish::Previous),
        _ => None,
    }
}

/// Nothing can be done if the terminal does not take it.
fn give_back() {
    let _ = disable_raw_mode();
    let _ = execute!(io::stdout(), LeaveAlternateScreen, Show);
}

/// A panic's text on a screen that is about to vanish is read by nobody.
fn keep_panics_readable(told: Sender<Told>) {
    let (draws, before) = (thread::current().id(), panic::take_hook());
    panic::set_hook(Box::new(move |panic| {
        if thread::current().id() == draws {
            give_back();
            before(panic);
        } else {
            let _ = told.try_send(Told::Warning(panic.to_string().replace('\n', ": ")));
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::crossterm::event::KeyEventState;
    use std::process::Command;

    fn key(code: KeyCode, modifiers: KeyModifiers) -> Option<Wish> {
        let (kind, state) = (KeyEventKind::Press, KeyEventState::NONE);
        meaning(&Event::Key(KeyEvent { code, modifiers, kind, state }))
    }

    #[test]
    fn keys() {
        let plain = |code| key(code, KeyModifiers::NONE);
        for code in [KeyCode::Char('q'), KeyCode::Esc] {
            assert_eq!(plain(code), Some(Wish::Quit));
        }
        assert_eq!(key(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Wish::Quit));
        assert_eq!(plain(KeyCode::Char('c')), None);
        assert_eq!(plain(KeyCode::Char(' ')), Some(Wish::Hold));
        assert_eq!((plain(KeyCode::Tab), plain(KeyCode::Down)), (Some(Wish::Next), Some(Wish::Next)));
        assert_eq!(
            (plain(KeyCode::BackTab), plain(KeyCode::Up)),
            (Some(Wish::Previous), Some(Wish::Previous))
        );
        assert_eq!(meaning(&Event::FocusLost), None);
    }

    /// Runs the test below in a terminal of its own.
    #[test]
    fn a_panic_is_read_on_the_terminal_as_it_was() {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/top/terminal.py");
        let test = "top::screen::tests::panics_while_it_draws";
        let output = Command::new("python3")
            .args([script, "80", "24", "[]", "--"])
            .arg(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "--nocapture", test])
            .output();
        let Ok(output) = output else {
            assert!(std::env::var_os("SELECTOR_REQUIRE_PEERS").is_none(), "python3 is required here");
            eprintln!("skipped: there is no python3");
            return;
        };
        let shown: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let written = shown["output"].as_str().unwrap();
        assert_eq!((&shown["exit"], &shown["restored"]), (&101.into(), &true.into()), "{written}");
        let at = |text: &str| written.find(text).unwrap_or_else(|| panic!("no {text} in {written:?}"));
        assert!(at("\x1b[?1049h") < at("\x1b[?1049l") && at("\x1b[?1049l") < at("on purpose"), "{written:?}");
    }

    #[test]
    #[ignore = "needs a terminal; the test above gives it one"]
    fn panics_while_it_draws() {
        let (told, _heard) = crossbeam_channel::bounded(1);
        let _screen = Screen::open(told).unwrap();
        panic!("on purpose");
    }
}
