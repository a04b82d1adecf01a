//! Everything that can go wrong while a map is read, built or written, as values.
//!
//! A fatal fault is a [`MapError`]. A defect of an OSM map that Autoware's loader would report is a
//! [`LoadIssue`]: the strict mode turns a non-empty list of them into [`MapError::Refused`], the lenient
//! mode hands the list back beside the map.

use std::fmt;
use std::path::PathBuf;

use crate::projection::ProjectionError;

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The bytes are not a lanelet2 archive, or a damaged one.
    #[error(
        "map archive, byte {offset}: {problem}; ask for the map again, or write the archive anew with the map loader"
    )]
    Archive {
        /// Offset of the first byte that could not be accepted.
        offset: usize,
        /// What is wrong there.
        problem: ArchiveProblem,
    },
    /// The file is not well-formed XML or not an OSM file.
    #[error("map file, line {line}: {problem}; correct the file or export it again")]
    Xml {
        /// Line number, counted from 1.
        line: usize,
        /// What is wrong there.
        problem: XmlProblem,
    },
    /// A point has a coordinate that is NaN or infinite. Such a map must never reach a safety check.
    #[error("point {point} has a coordinate that is not finite; correct the point in the map")]
    NonFinitePoint {
        /// Id of the point.
        point: i64,
    },
    /// A position cannot be projected.
    #[error(
        "node {node} cannot be projected: {problem}; choose the projector the map was made for, or correct the node"
    )]
    Projection {
        /// Id of the node.
        node: i64,
        /// What the projector says.
        problem: ProjectionError,
    },
    /// `local_x` or `local_y` is not a number, and the projector is `Local`.
    #[error("the tag `{key}` of node {node} is not a number; correct it, or use another projector")]
    LocalCoordinate {
        /// Id of the node.
        node: i64,
        /// `local_x` or `local_y`.
        key: &'static str,
    },
    /// Two elements of one layer have the same id.
    #[error("two {layer} have the id {id}; give one of them another id")]
    DuplicateId {
        /// The layer.
        layer: Layer,
        /// The id.
        id: i64,
    },
    /// An element names another one that was never added.
    #[error("element {user} names {id} of the {layer}, which is not there; add it first")]
    UnknownId {
        /// The element that names the missing one.
        user: i64,
        /// The layer that was searched.
        layer: Layer,
        /// The missing id.
        id: i64,
    },
    /// Strict loading: the map has defects.
    #[error("the map has {} defects, the first is: {}; correct the map, or load it in lenient mode",
            issues.len(), FirstIssue(issues))]
    Refused {
        /// All defects, in the order they were met.
        issues: Vec<LoadIssue>,
    },
    /// `map_projector_info.yaml` cannot be used.
    #[error("map projector file, line {line}: {problem}; correct that line")]
    ProjectorInfo {
        /// Line number, counted from 1; 0 where something is missing in the whole file.
        line: usize,
        /// What is wrong there.
        problem: ProjectorInfoProblem,
    },
    /// A file cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// The operating system's answer.
        source: std::io::Error,
    },
    /// Centerlines with more points than any map has: positions are wrong, or the unit of length is.
    #[error(
        "lanelet {lanelet} is {length_m:.0} m long, with it the centerlines have more than {limit} points; \
            check the positions of its points"
    )]
    EndlessCenterline {
        /// The lanelet with which there are too many.
        lanelet: i64,
        /// Length of the longer of its bounds.
        length_m: f64,
        /// Most points that are made.
        limit: usize,
    },
    /// More bytes or elements than the compact indexes can hold.
    #[error("the map is larger than the supported {limit} bytes; split it into parts")]
    TooLarge {
        /// The limit.
        limit: usize,
    },
}

/// What is wrong with an archive. Numbers are as found in the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArchiveProblem {
    /// The data end too early.
    #[error("the data end, {needed} more bytes were expected")]
    Truncated {
        /// Bytes that should follow.
        needed: usize,
    },
    /// The signature is not that of a Boost archive.
    #[error("this is not a Boost archive")]
    NotAnArchive,
    /// The library version is below 8.
    #[error("archive library version {found} is too old, at least 8 is needed")]
    UnsupportedVersion {
        /// Version in the header.
        found: u16,
    },
    /// The writer had other type sizes or another byte order.
    #[error("the archive was written on a machine with other type sizes or byte order")]
    ForeignLayout,
    /// A one-byte flag is neither 0 nor 1.
    #[error("a flag is {found}, only 0 and 1 are possible")]
    BadFlag {
        /// The byte.
        found: u8,
    },
    /// A count asks for more than the remaining bytes can hold.
    #[error("{count} elements cannot fit in the remaining bytes")]
    CountTooLarge {
        /// The count.
        count: u64,
    },
    /// A pointer is null where an object must be.
    #[error("a pointer to a {expected} is null")]
    NullPointer {
        /// What should be there.
        expected: &'static str,
    },
    /// A pointer's class id differs from earlier ones of the same type.
    #[error("class id {found} for a {expected}, earlier ones had {known}")]
    ClassId {
        /// The class id read.
        found: i16,
        /// The class id of earlier pointers.
        known: i16,
        /// The type pointed to.
        expected: &'static str,
    },
    /// An object id is neither known nor the next new one.
    #[error("object id {found} is neither known nor the next one ({next})")]
    ObjectId {
        /// The id read.
        found: u32,
        /// The next new id.
        next: u32,
    },
    /// A known object has another type than the place needs.
    #[error("object {id} is not a {expected}")]
    WrongKind {
        /// Object id.
        id: u32,
        /// What the place needs.
        expected: &'static str,
    },
    /// A rule parameter of unknown kind.
    #[error("rule parameter kind {found} is unknown, 0 to 4 are possible")]
    ParameterKind {
        /// The kind read.
        found: i32,
    },
    /// The two copies of a regulatory element's id differ.
    #[error("regulatory element {outer} carries the data of {inner}")]
    RegulatoryId {
        /// Id before the data.
        outer: i64,
        /// Id inside the data.
        inner: i64,
    },
    /// Data follow after the end.
    #[error("{count} bytes follow after the end of the map")]
    TrailingBytes {
        /// How many.
        count: usize,
    },
}

/// What is wrong with an OSM file as XML.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum XmlProblem {
    /// A tag, comment or declaration does not end.
    #[error("a tag, comment or declaration does not end")]
    UnfinishedTag,
    /// An attribute is not of the form `name="value"`.
    #[error("an attribute is not of the form name=\"value\"")]
    BadAttribute,
    /// A closing tag closes another element than the one that is open.
    #[error("</{found}> where <{expected}> is open")]
    MismatchedEnd {
        /// The element that is open; empty if there is none.
        expected: String,
        /// The element that is closed.
        found: String,
    },
    /// The file ends inside an element.
    #[error("the file ends inside <{name}>")]
    UnfinishedElement {
        /// The element that is open.
        name: String,
    },
    /// No `<osm>` element.
    #[error("there is no <osm> element")]
    NoOsmElement,
}

/// What is wrong with a projector file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProjectorInfoProblem {
    /// A line is not `key: value`.
    #[error("this is not `key: value`")]
    NotKeyValue,
    /// `projector_type` is missing.
    #[error("`projector_type` is missing")]
    MissingType,
    /// `projector_type` has an unknown value (it is case-sensitive).
    #[error(
        "`projector_type` {0:?} is unknown, expected Local, MGRS, LocalCartesianUTM, LocalCartesian or TransverseMercator"
    )]
    UnknownType(String),
    /// A number cannot be read.
    #[error("{value:?} is not a number for `{key}`")]
    NotANumber {
        /// The key.
        key: String,
        /// The text.
        value: String,
    },
    /// The projector needs an origin.
    #[error("this projector needs `map_origin` with `latitude` and `longitude`")]
    MissingOrigin,
}

/// A layer of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// Points.
    Points,
    /// Line strings.
    LineStrings,
    /// Polygons.
    Polygons,
    /// Areas.
    Areas,
    /// Lanelets.
    Lanelets,
    /// Regulatory elements.
    RegulatoryElements,
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Points => "points",
            Self::LineStrings => "line strings",
            Self::Polygons => "polygons",
            Self::Areas => "areas",
            Self::Lanelets => "lanelets",
            Self::RegulatoryElements => "regulatory elements",
        })
    }
}

/// A defect of an OSM map: the element keeps what could be understood, or is left out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("element {id}: {kind}")]
pub struct LoadIssue {
    /// Id of the element with the defect.
    pub id: i64,
    /// The defect.
    pub kind: IssueKind,
}

/// Kinds of [`LoadIssue`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IssueKind {
    /// A way names a node that is not in the file; the way loses all its points.
    #[error("the way names the missing node {node}")]
    MissingNode {
        /// The missing node.
        node: i64,
    },
    /// A way has no points; it is left out.
    #[error("the way has no points")]
    EmptyWay,
    /// A relation names an element that is not in the file; the member is left out.
    #[error("the relation names the missing element {member}")]
    MissingMember {
        /// The missing element.
        member: i64,
    },
    /// A lanelet does not have exactly one left or right border; an empty border takes its place.
    #[error("the lanelet has {found} borders with role `{role}`, exactly one is needed")]
    BorderCount {
        /// `left` or `right`.
        role: &'static str,
        /// How many were found.
        found: usize,
    },
    /// A member exists but could not be built, or is of a kind that cannot be used there.
    #[error("the member {member} cannot be used")]
    UnusableMember {
        /// The member.
        member: i64,
    },
    /// Ways of an area do not form closed, simple rings; the ring is left out.
    #[error("the ways with role `{role}` do not form a closed ring without self-intersection")]
    BrokenRing {
        /// `outer` or `inner`.
        role: &'static str,
    },
    /// An area does not have exactly one outer ring; it is left out.
    #[error("the area has {found} outer rings, exactly one is needed")]
    OuterRingCount {
        /// How many were found.
        found: usize,
    },
    /// A regulatory element without `subtype`; it is left out.
    #[error("the regulatory element has no subtype")]
    NoSubtype,
    /// A regulatory element of a subtype that Autoware does not know; it is left out.
    #[error("the regulatory element has the unknown subtype {subtype:?}")]
    UnknownSubtype {
        /// The subtype.
        subtype: String,
    },
    /// A regulatory element that lacks what its subtype needs; it is left out.
    #[error("the regulatory element of subtype {subtype:?} needs {needs}")]
    IncompleteRule {
        /// The subtype.
        subtype: String,
        /// What it needs.
        needs: &'static str,
    },
    /// An element names a regulatory element that was not built; an empty one takes its place.
    #[error("the element names the regulatory element {rule}, which was not built")]
    MissingRule {
        /// The regulatory element.
        rule: i64,
    },
    /// MGRS coordinates are only unique inside one 100 km square, and this node lies in another one than
    /// most: it would land up to 100 km from where it is.
    #[error("the node lies in the 100 km square {found}, other nodes in {others}; use another projector")]
    GridChange {
        /// Square of this node, as (column, row) of 100 km.
        found: GridSquare,
        /// Square of the first node of the file.
        others: GridSquare,
    },
}

/// A 100 km square of the UTM grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridSquare {
    /// UTM zone, 1 to 60.
    pub zone: u8,
    /// Northern hemisphere.
    pub north: bool,
    /// Easting divided by 100 km, rounded down.
    pub column: i32,
    /// Northing divided by 100 km, rounded down.
    pub row: i32,
}

impl fmt::Display for GridSquare {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hemisphere = if self.north { 'N' } else { 'S' };
        write!(f, "{}{hemisphere} {}/{}", self.zone, self.column, self.row)
    }
}

struct FirstIssue<'a>(&'a [LoadIssue]);

impl fmt::Display for FirstIssue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.first() {
            Some(issue) => issue.fmt(f),
            None => f.write_str("none"),
        }
    }
}
