//! What a traffic light shows, and what its lamps say to a driver.

use messages::autoware_perception_msgs::{TrafficLightElement, TrafficLightGroup};
use smallvec::SmallVec;

/// One lamp as far as it matters: colour, shape and state, but not the confidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lamp {
    color: u8,
    shape: u8,
    status: u8,
}

impl From<&TrafficLightElement> for Lamp {
    fn from(element: &TrafficLightElement) -> Self {
        Self { color: element.color, shape: element.shape, status: element.status }
    }
}

/// The lamps of one light in the order of its message.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Lamps(SmallVec<[Lamp; 8]>);

impl From<&TrafficLightGroup> for Lamps {
    fn from(group: &TrafficLightGroup) -> Self {
        Self(group.elements.iter().map(Lamp::from).collect())
    }
}

/// Where a lane turns, as far as arrows speak about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TurnDirection {
    /// `left`.
    Left,
    /// `right`.
    Right,
    /// `straight`.
    Straight,
    /// Not said, or no known direction: no arrow helps.
    Other,
}

impl TurnDirection {
    /// From the attribute `turn_direction` of a lanelet.
    pub(super) fn from_attribute(value: Option<&str>) -> Self {
        match value {
            Some("left") => Self::Left,
            Some("right") => Self::Right,
            Some("straight") => Self::Straight,
            _ => Self::Other,
        }
    }

    /// Left or right.
    pub(super) fn is_to_a_side(self) -> bool {
        matches!(self, Self::Left | Self::Right)
    }

    fn arrow(self) -> Option<u8> {
        match self {
            Self::Left => Some(TrafficLightElement::LEFT_ARROW),
            Self::Right => Some(TrafficLightElement::RIGHT_ARROW),
            Self::Straight => Some(TrafficLightElement::UP_ARROW),
            Self::Other => None,
        }
    }
}

impl Lamps {
    fn shows(&self, color: u8, shape: u8) -> bool {
        self.0.iter().any(|lamp| lamp.color == color && lamp.shape == shape)
    }

    /// No lamp at all.
    pub(super) fn is_dark(&self) -> bool {
        self.0.is_empty()
    }

    /// A red circle.
    pub(super) fn is_red(&self) -> bool {
        self.shows(TrafficLightElement::RED, TrafficLightElement::CIRCLE)
    }

    /// An amber circle.
    pub(super) fn is_amber(&self) -> bool {
        self.shows(TrafficLightElement::AMBER, TrafficLightElement::CIRCLE)
    }

    /// A green circle.
    pub(super) fn is_green(&self) -> bool {
        self.shows(TrafficLightElement::GREEN, TrafficLightElement::CIRCLE)
    }

    /// A lamp of unknown colour, whatever its shape.
    pub(super) fn is_unknown(&self) -> bool {
        self.0.iter().any(|lamp| lamp.color == TrafficLightElement::UNKNOWN)
    }

    /// Whether a lane that turns this way may go: a green circle, or a green arrow in its direction.
    pub(super) fn lets_go(&self, turn: TurnDirection) -> bool {
        self.is_green() || turn.arrow().is_some_and(|arrow| self.shows(TrafficLightElement::GREEN, arrow))
    }

    /// Takes over the lamps of a message; true if they differ from those before, in number, order, colour, shape or
    /// state.
    pub(super) fn replace_if_changed(&mut self, group: &TrafficLightGroup) -> bool {
        let equal = self.0.len() == group.elements.len()
            && self.0.iter().zip(&group.elements).all(|(lamp, element)| *lamp == Lamp::from(element));
        if !equal {
            self.0.clear();
            self.0.extend(group.elements.iter().map(Lamp::from));
        }
        !equal
    }
}
