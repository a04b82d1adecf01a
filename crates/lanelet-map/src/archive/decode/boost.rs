//! Boost's machinery under the format: class preambles, object ids, pointers, containers.

use super::Decoder;
use crate::archive::class::{Class, Kind};
use crate::archive::reader::Fault;
use crate::error::ArchiveProblem;

/// What the archive has said about a type.
#[derive(Debug, Clone, Copy)]
pub(super) enum ClassState {
    Unseen,
    Seen { tracked: bool, class_id: i16 },
}

/// An object that can be referred to: kind and arena index in four bytes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Object(u32);

impl Object {
    pub(super) fn new(kind: Kind, index: usize) -> Self {
        Self(((kind as u32) << 29) | (index as u32 & 0x1fff_ffff))
    }

    /// The arena index, if the object is of this kind.
    #[inline]
    fn index_as(self, kind: Kind) -> Option<u32> {
        (self.0 >> 29 == kind as u32).then_some(self.0 & 0x1fff_ffff)
    }
}

/// The end of a pointer.
pub(super) enum Target {
    Known(u32),
    New,
}

impl Decoder<'_> {
    /// Begins a value: its preamble at the first meeting, and an object id if the type is tracked.
    #[inline]
    pub(super) fn value(&mut self, class: Class) -> Result<(), Fault> {
        if self.is_tracked(class)? { self.tracked_value() } else { Ok(()) }
    }

    #[inline]
    pub(super) fn is_tracked(&mut self, class: Class) -> Result<bool, Fault> {
        match self.classes[class as usize] {
            ClassState::Seen { tracked, .. } => Ok(tracked),
            ClassState::Unseen => self.preamble(class, 0),
        }
    }

    #[cold]
    fn preamble(&mut self, class: Class, class_id: i16) -> Result<bool, Fault> {
        let tracked = self.reader.flag()?;
        let version = self.reader.u32()?;
        if tracked != class.is_tracked() || version != class.version() {
            self.unfamiliar_types += 1;
        }
        self.classes[class as usize] = ClassState::Seen { tracked, class_id };
        Ok(tracked)
    }

    /// A tracked value takes a number like any object. A second meeting would need the value itself kept; no
    /// writer makes one, since the values live in different places of the writer's memory.
    #[cold]
    fn tracked_value(&mut self) -> Result<(), Fault> {
        match self.object(Kind::Other)? {
            Some(_) => Err(self.reader.fault(
                4,
                ArchiveProblem::WrongKind {
                    id: self.objects.len() as u32,
                    expected: "value that can be met twice",
                },
            )),
            None => {
                self.objects.push(Object::new(Kind::Other, 0));
                Ok(())
            }
        }
    }

    /// An object id: the index of a known object, or nothing for a new one.
    #[inline]
    pub(super) fn object(&mut self, kind: Kind) -> Result<Option<u32>, Fault> {
        let id = self.reader.u32()?;
        let next = self.objects.len() as u32;
        match self.objects.get(id as usize) {
            Some(object) => match object.index_as(kind) {
                Some(index) => Ok(Some(index)),
                None => Err(self.reader.fault(4, ArchiveProblem::WrongKind { id, expected: kind.name() })),
            },
            None if id == next => Ok(None),
            None => Err(self.reader.fault(4, ArchiveProblem::ObjectId { found: id, next })),
        }
    }

    /// A `shared_ptr`. The caller adds a new target to the arena of `kind`, at index `next`.
    #[inline]
    pub(super) fn pointer(
        &mut self,
        shared: Class,
        data: Class,
        kind: Kind,
        next: usize,
    ) -> Result<Target, Fault> {
        self.value(shared)?;
        let found = self.reader.i16()?;
        if found == -1 {
            return Err(self.reader.fault(2, ArchiveProblem::NullPointer { expected: kind.name() }));
        }
        let tracked = match self.classes[data as usize] {
            ClassState::Unseen => self.preamble(data, found)?,
            ClassState::Seen { tracked, class_id } if class_id == found => tracked,
            ClassState::Seen { class_id: known, .. } => {
                let problem = ArchiveProblem::ClassId { found, known, expected: kind.name() };
                return Err(self.reader.fault(2, problem));
            }
        };
        if tracked {
            if let Some(index) = self.object(kind)? {
                return Ok(Target::Known(index));
            }
            self.objects.push(Object::new(kind, next));
        }
        Ok(Target::New)
    }

    /// The count and item version of a container, without the part of its preamble.
    #[inline]
    pub(super) fn container(&mut self, class: Class, smallest: usize) -> Result<usize, Fault> {
        self.value(class)?;
        let count = self.reader.count(smallest, self.promised)?;
        let _item_version = self.reader.u32()?;
        Ok(count)
    }
}
