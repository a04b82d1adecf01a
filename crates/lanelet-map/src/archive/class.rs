//! The C++ types of the archive, each with its entry in the class table.

/// A type with a preamble at its first meeting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    LaneletMap,
    Point,
    PointPointer,
    PointData,
    AttributeMap,
    AttributePair,
    Attribute,
    LineString,
    Polygon,
    LineStringPointer,
    LineStringData,
    Points,
    Area,
    AreaPointer,
    AreaData,
    Rings,
    LineStrings,
    Lanelet,
    LaneletPointer,
    LaneletData,
    RulePointer,
    RuleDataPointer,
    RuleData,
    RoleMap,
    RolePair,
    Parameters,
    Parameter,
    WeakLanelet,
    WeakArea,
}

impl Class {
    pub(super) const COUNT: usize = Self::WeakArea as usize + 1;

    /// Whether writers give objects of this type an object id.
    pub(super) fn is_tracked(self) -> bool {
        matches!(
            self,
            Self::PointData
                | Self::LineStringData
                | Self::AreaData
                | Self::LaneletData
                | Self::RuleData
                | Self::Parameter
        )
    }

    /// Class version that writers give.
    pub(super) fn version(self) -> u32 {
        u32::from(matches!(
            self,
            Self::PointPointer
                | Self::LineStringPointer
                | Self::AreaPointer
                | Self::LaneletPointer
                | Self::RulePointer
                | Self::RuleDataPointer
        ))
    }
}

/// Kinds of objects that can be referred to by object id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Point = 0,
    Line = 1,
    Area = 2,
    Lanelet = 3,
    Rule = 4,
    Parameter = 5,
    /// A tracked value of another type: it takes an object id, but a reference to it is not possible.
    Other = 6,
}

impl Kind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Line => "line string",
            Self::Area => "area",
            Self::Lanelet => "lanelet",
            Self::Rule => "regulatory element",
            Self::Parameter => "rule parameter",
            Self::Other => "value",
        }
    }
}
