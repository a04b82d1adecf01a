//! Recordings: MCAP, sqlite3, and the folder that says what belongs together.

use std::cell::RefCell;
use std::fs::File;
use std::io::{Cursor, Seek as _, Write as _};
use std::path::Path;
use tempfile::TempDir;
use trajectory_selector::bag::{self, McapWriter, QosProfile, Reader, WriterOptions};

/// Reads to the end, however it ends. Times do not go back, and behind an error comes no message.
fn read_all(reader: Reader) {
    let connections = reader.connections().len();
    let (mut last_ns, mut has_ended) = (0, false);
    for message in reader {
        let Ok(message) = message else {
            has_ended = true;
            continue;
        };
        assert!(!has_ended, "a message behind an error");
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

/// A file in a folder of its own that is written for every run: in memory where the system has such files.
struct Scratch {
    folder: TempDir,
    file: File,
}

impl Scratch {
    fn new(name: &str) -> Self {
        let memory = Path::new("/dev/shm");
        let place = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let folder = TempDir::new_in(place).expect("a folder can be made");
        let file = File::create(folder.path().join(name)).expect("a file can be made");
        Self { folder, file }
    }

    /// From now on the file holds these bytes.
    fn hold(&mut self, bytes: &[u8]) -> &Path {
        let written = self.file.rewind().and_then(|()| self.file.write_all(bytes));
        written.and_then(|()| self.file.set_len(bytes.len() as u64)).expect("it can be written");
        self.folder.path()
    }
}

thread_local! {
    static DATABASE: RefCell<Scratch> = RefCell::new(Scratch::new("fuzzed.db3"));
    static METADATA: RefCell<Scratch> = RefCell::new(folder_of_a_recording());
}

/// The folder of a recording `a.db3`, which is MCAP: what a file is called is of no matter.
fn folder_of_a_recording() -> Scratch {
    let scratch = Scratch::new("metadata.yaml");
    let recorded = McapWriter::create(scratch.folder.path().join("a.db3"), WriterOptions::default());
    let written = recorded.and_then(|mut writer| {
        let topic = writer.add_topic("/a", "std_msgs/msg/String", "string data", QosProfile::default())?;
        (1..4).try_for_each(|time_ns| writer.write(topic, time_ns, time_ns, vec![0; 8]))?;
        writer.finish()
    });
    written.expect("a recording can be made");
    scratch
}

fn open_and_read(path: &Path) {
    if let Ok(reader) = bag::open(path) {
        read_all(reader);
    }
}

/// A sqlite3 file.
pub fn sqlite(bytes: &[u8]) {
    DATABASE.with_borrow_mut(|database| open_and_read(&database.hold(bytes).join("fuzzed.db3")));
}

/// The `metadata.yaml` of a folder with one recording in it.
pub fn bag_folder(bytes: &[u8]) {
    METADATA.with_borrow_mut(|metadata| open_and_read(metadata.hold(bytes)));
}
