//! Recordings: MCAP, sqlite3, and the folder that says what belongs together.

use std::cell::RefCell;
use std::fs;
use std::io::Cursor;
use std::path::Path;
use tempfile::TempDir;
use trajectory_selector::bag::{self, Reader};

/// Reads to the end, however it ends. Times do not go back.
fn read_all(reader: Reader) {
    let connections = reader.connections().len();
    let mut last_ns = i64::MIN;
    for message in reader {
        let Ok(message) = message else { continue };
        assert!(message.connection < connections, "a message of a connection that there is not");
        assert!(message.log_time_ns >= last_ns, "time goes back");
        last_ns = message.log_time_ns;
    }
}

/// An MCAP file.
pub fn mcap(bytes: &[u8]) {
    if let Ok(reader) = Reader::from_mcap("fuzzed.mcap", Cursor::new(bytes.to_vec())) {
        read_all(reader);
    }
}

thread_local! {
    /// In memory where the system has such files: it is written for every run.
    static FOLDER: RefCell<Option<TempDir>> = const { RefCell::new(None) };
}

fn with_folder(work: impl FnOnce(&Path)) {
    FOLDER.with_borrow_mut(|folder| {
        let memory = Path::new("/dev/shm");
        let place = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let folder = folder.get_or_insert_with(|| TempDir::new_in(place).expect("a folder can be made"));
        work(folder.path());
    });
}

/// A sqlite3 file.
pub fn sqlite(bytes: &[u8]) {
    with_folder(|folder| {
        let path = folder.join("fuzzed.db3");
        fs::write(&path, bytes).expect("it can be written");
        if let Ok(reader) = bag::open(&path) {
            read_all(reader);
        }
    });
}

/// The `metadata.yaml` of a folder with nothing else in it.
pub fn bag_folder(bytes: &[u8]) {
    with_folder(|folder| {
        let folder = folder.join("recording");
        if !folder.is_dir() {
            fs::create_dir(&folder).expect("it can be made");
        }
        fs::write(folder.join("metadata.yaml"), bytes).expect("it can be written");
        if let Ok(reader) = bag::open(&folder) {
            read_all(reader);
        }
    });
}
