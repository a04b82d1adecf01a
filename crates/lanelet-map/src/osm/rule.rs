//! What Autoware's traffic rules need to exist.

use crate::error::IssueKind;
use crate::map::store::{Parameter, ParameterKind};

/// Members of a regulatory element by role, in file order.
pub(super) struct Members<'a> {
    pub(super) roles: &'a [(&'a str, Parameter)],
    /// Whether the first element with role `refers` has an attribute `subtype`.
    pub(super) first_refers_has_subtype: bool,
    /// Whether the element itself has an attribute `sign_type`.
    pub(super) has_sign_type: bool,
}

impl Members<'_> {
    fn count(&self, role: &str, kinds: &[ParameterKind]) -> usize {
        self.roles.iter().filter(|(name, p)| *name == role && kinds.contains(&p.kind())).count()
    }

    fn lines(&self, role: &str) -> usize {
        self.count(role, &[ParameterKind::LineString])
    }

    fn polygons(&self, role: &str) -> usize {
        self.count(role, &[ParameterKind::Polygon])
    }

    fn lanelets(&self, role: &str) -> usize {
        self.count(role, &[ParameterKind::Lanelet])
    }
}

/// Whether Autoware builds the element, and if not, why.
pub(super) fn check(subtype: &str, members: &Members<'_>) -> Result<(), IssueKind> {
    let needs = match subtype {
        "traffic_light" => {
            let lights = members.count("refers", &[ParameterKind::LineString, ParameterKind::Polygon]);
            (lights == 0 || members.lines("ref_line") > 1)
                .then_some("at least one light (`refers`) and at most one `ref_line`")
        }
        "right_of_way" => (members.lanelets("right_of_way") == 0 || members.lanelets("yield") == 0)
            .then_some("lanelets with the roles `right_of_way` and `yield`"),
        "traffic_sign" | "speed_limit" => {
            let has_sign = members.count("refers", &[ParameterKind::LineString, ParameterKind::Polygon]) > 0;
            let is_known = if has_sign { members.first_refers_has_subtype } else { members.has_sign_type };
            (!is_known).then_some("a sign (`refers`) with a subtype, or the attribute `sign_type`")
        }
        "detection_area" => (members.polygons("refers") == 0 || members.lines("ref_line") != 1)
            .then_some("at least one polygon (`refers`) and exactly one `ref_line`"),
        "no_stopping_area" => (members.polygons("refers") == 0 || members.lines("ref_line") > 1)
            .then_some("at least one polygon (`refers`) and at most one `ref_line`"),
        "no_parking_area" | "bus_stop_area" => {
            (members.polygons("refers") == 0).then_some("at least one polygon (`refers`)")
        }
        "speed_bump" => (members.polygons("refers") != 1).then_some("exactly one polygon (`refers`)"),
        "road_marking" => (members.lines("refers") != 1).then_some("exactly one line string (`refers`)"),
        "virtual_traffic_light" => (members.lines("start_line") != 1 || members.lines("end_line") == 0)
            .then_some("exactly one `start_line` and at least one `end_line`"),
        "crosswalk" | "roundabout" | "all_way_stop" => None,
        _ => return Err(IssueKind::UnknownSubtype { subtype: subtype.to_owned() }),
    };
    match needs {
        None => Ok(()),
        Some(needs) => Err(IssueKind::IncompleteRule { subtype: subtype.to_owned(), needs }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::store::Handle;

    #[test]
    fn what_each_subtype_needs() {
        use ParameterKind::{Lanelet, LineString, Polygon};
        type Case<'a> = (&'a str, &'a [(&'a str, ParameterKind)], bool);
        let cases: &[Case<'_>] = &[
            ("traffic_light", &[], false),
            ("traffic_light", &[("refers", LineString)], true),
            ("traffic_light", &[("refers", Polygon), ("ref_line", LineString)], true),
            (
                "traffic_light",
                &[("refers", LineString), ("ref_line", LineString), ("ref_line", LineString)],
                false,
            ),
            ("right_of_way", &[("right_of_way", Lanelet)], false),
            ("right_of_way", &[("right_of_way", Lanelet), ("yield", Lanelet)], true),
            ("detection_area", &[("refers", Polygon)], false),
            ("detection_area", &[("refers", Polygon), ("ref_line", LineString)], true),
            ("detection_area", &[("refers", LineString), ("ref_line", LineString)], false),
            ("no_stopping_area", &[("refers", Polygon)], true),
            ("no_parking_area", &[], false),
            ("bus_stop_area", &[("refers", Polygon)], true),
            ("speed_bump", &[("refers", Polygon), ("refers", Polygon)], false),
            ("road_marking", &[("refers", LineString)], true),
            ("virtual_traffic_light", &[("start_line", LineString)], false),
            ("virtual_traffic_light", &[("start_line", LineString), ("end_line", LineString)], true),
            ("traffic_sign", &[("refers", LineString)], false),
            ("traffic_sign", &[], false),
            ("crosswalk", &[], true),
            ("no_such_rule", &[], false),
        ];
        for (subtype, roles, expected) in cases {
            let roles: Vec<_> = roles
                .iter()
                .map(|(role, kind)| (*role, Parameter::new(*kind, Handle::new(0, false))))
                .collect();
            let members = Members { roles: &roles, first_refers_has_subtype: false, has_sign_type: false };
            assert_eq!(check(subtype, &members).is_ok(), *expected, "{subtype} {}", roles.len());
        }
    }
}
