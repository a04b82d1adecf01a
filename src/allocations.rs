//! Counts heap allocations, for those who want to know: `stress` shows that judging makes none.
//!
//! The one module that allocates by hand, and so the one with unsafe code: it hands every request to the system's
//! allocator unchanged, and counts while counting is on. While it is off, a request costs one load and one branch more.
#![expect(unsafe_code, reason = "an allocator cannot be written without; every call is handed on unchanged")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

static COUNTING: AtomicBool = AtomicBool::new(false);
static ALL_THREADS: AtomicU64 = AtomicU64::new(0);
static OUTSTANDING_BYTES: AtomicI64 = AtomicI64::new(0);

thread_local! {
    // Constant and without a destructor, so that reading it allocates nothing at any time of a thread's life.
    static THIS_THREAD: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator with a counter.
#[derive(Debug, Clone, Copy)]
pub struct CountingAllocator;

/// Begins to count, for the rest of the process.
pub fn start_counting() {
    COUNTING.store(true, Ordering::Relaxed);
}

/// Whether anybody asked for counting.
#[must_use]
pub fn is_counting() -> bool {
    COUNTING.load(Ordering::Relaxed)
}

/// Requests for memory since counting began, by all threads. 0 if the program does not use [`CountingAllocator`].
#[must_use]
pub fn of_all_threads() -> u64 {
    ALL_THREADS.load(Ordering::Relaxed)
}

/// The same, by the calling thread.
#[must_use]
pub fn of_this_thread() -> u64 {
    THIS_THREAD.get()
}

/// Bytes that were asked for since counting began, less those given back; what is given back may be older, so it can be
/// below zero.
#[must_use]
pub fn outstanding_bytes() -> i64 {
    OUTSTANDING_BYTES.load(Ordering::Relaxed)
}

fn count(more_bytes: usize, fewer_bytes: usize) {
    if COUNTING.load(Ordering::Relaxed) {
        ALL_THREADS.fetch_add(1, Ordering::Relaxed);
        THIS_THREAD.set(THIS_THREAD.get() + 1);
        // A size is at most `isize::MAX`.
        OUTSTANDING_BYTES.fetch_add(more_bytes as i64 - fewer_bytes as i64, Ordering::Relaxed);
    }
}

fn count_return(bytes: usize) {
    if COUNTING.load(Ordering::Relaxed) {
        OUTSTANDING_BYTES.fetch_sub(bytes as i64, Ordering::Relaxed);
    }
}

// SAFETY: every method hands its arguments to the system's allocator unchanged and returns what that returns; the
// counters touch no memory that is being allocated.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(new_size, layout.size());
        // SAFETY: the caller keeps the contract of `realloc`.
        unsafe { System.realloc(block, layout, new_size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count_return(layout.size());
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(block, layout) }
    }
}
