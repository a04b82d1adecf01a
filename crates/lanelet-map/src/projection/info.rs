//! `map_projector_info.yaml`, the small file that lies beside a map.
//!
//! Only the keys that change coordinates are read: `projector_type`, `map_origin.latitude`,
//! `map_origin.longitude` and `scale_factor`. Other keys are passed over. The file is flat enough to be read line by
//! line: `key: value`, comments behind `#`, quotes around values, `map_origin` as an indented block or in braces.

use super::{GeoPoint, Projector};
use crate::error::{MapError, ProjectorInfoProblem};

/// Scale factor where the file gives none.
const DEFAULT_SCALE: f32 = 0.9996;

/// The projector that the text of the file names.
///
/// # Errors
/// [`MapError::ProjectorInfo`] with the line.
pub fn read_projector_info(text: &str) -> Result<Projector, MapError> {
    let mut kind = None;
    let (mut latitude_deg, mut longitude_deg, mut scale) = (None, None, DEFAULT_SCALE);
    for (at, line) in text.lines().enumerate() {
        let fail = |problem| MapError::ProjectorInfo { line: at + 1, problem };
        for (key, value) in pairs(line).map_err(fail)? {
            match key {
                "projector_type" => kind = Some((at + 1, value)),
                "latitude" => latitude_deg = Some(number(key, value).map_err(fail)?),
                "longitude" => longitude_deg = Some(number(key, value).map_err(fail)?),
                // Single precision as in the message, whose value the map maker's tools have used.
                "scale_factor" => scale = number(key, value).map_err(fail)? as f32,
                _ => {}
            }
        }
    }
    let (line, kind) =
        kind.ok_or(MapError::ProjectorInfo { line: 0, problem: ProjectorInfoProblem::MissingType })?;
    let origin = match (latitude_deg, longitude_deg) {
        (Some(latitude_deg), Some(longitude_deg)) => Ok(GeoPoint { latitude_deg, longitude_deg }),
        _ => Err(MapError::ProjectorInfo { line, problem: ProjectorInfoProblem::MissingOrigin }),
    };
    match kind {
        "Local" => Ok(Projector::Local),
        "MGRS" => Ok(Projector::Mgrs),
        "LocalCartesianUTM" => Ok(Projector::LocalCartesianUtm { origin: origin? }),
        "LocalCartesian" => Ok(Projector::LocalCartesian { origin: origin? }),
        "TransverseMercator" => {
            Ok(Projector::TransverseMercator { origin: origin?, scale: f64::from(scale) })
        }
        other => Err(MapError::ProjectorInfo {
            line,
            problem: ProjectorInfoProblem::UnknownType(other.to_owned()),
        }),
    }
}

/// The pairs of a line; an outer key such as `map_origin:` is dropped, since no inner key is ambiguous.
fn pairs(line: &str) -> Result<Vec<(&str, &str)>, ProjectorInfoProblem> {
    let content = line.split('#').next().unwrap_or("").trim();
    if content.is_empty() || content == "---" {
        return Ok(Vec::new());
    }
    let (key, value) = split(content)?;
    match value.strip_prefix('{').map(|inside| inside.trim_end_matches('}')) {
        Some(inside) => inside.split(',').map(|pair| split(pair.trim())).collect(),
        None => Ok(vec![(key, value)]),
    }
}

fn split(pair: &str) -> Result<(&str, &str), ProjectorInfoProblem> {
    let (key, value) = pair.split_once(':').ok_or(ProjectorInfoProblem::NotKeyValue)?;
    Ok((key.trim(), value.trim().trim_matches(['"', '\''])))
}

fn number(key: &str, value: &str) -> Result<f64, ProjectorInfoProblem> {
    value
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| ProjectorInfoProblem::NotANumber { key: key.to_owned(), value: value.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_projectors_by_name() {
        let origin = GeoPoint { latitude_deg: 35.6, longitude_deg: 139.5 };
        for (text, expected) in [
            ("projector_type: MGRS\nvertical_datum: WGS84\nmgrs_grid: 54SUE\n", Projector::Mgrs),
            ("# site\nprojector_type: \"Local\" # no lat/lon\n", Projector::Local),
            (
                "projector_type: LocalCartesianUTM\nmap_origin:\n  latitude: 35.6\n  longitude: 139.5\n  altitude: 0.0\n",
                Projector::LocalCartesianUtm { origin },
            ),
            (
                "projector_type: LocalCartesian\nmap_origin: {latitude: 35.6, longitude: 139.5}\n",
                Projector::LocalCartesian { origin },
            ),
            (
                "projector_type: TransverseMercator\nscale_factor: 0.9999\nmap_origin:\n  latitude: 35.6\n  longitude: 139.5\n",
                Projector::TransverseMercator { origin, scale: f64::from(0.9999_f32) },
            ),
        ] {
            assert_eq!(read_projector_info(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn what_cannot_be_used_names_its_line() {
        use ProjectorInfoProblem as P;
        for (text, line, problem) in [
            ("", 0, P::MissingType),
            ("vertical_datum: WGS84\n", 0, P::MissingType),
            ("a: 1\nprojector_type: mgrs\n", 2, P::UnknownType("mgrs".to_owned())),
            ("projector_type MGRS\n", 1, P::NotKeyValue),
            ("projector_type: LocalCartesian\n", 1, P::MissingOrigin),
            (
                "projector_type: LocalCartesian\nmap_origin:\n  latitude: north\n",
                3,
                P::NotANumber { key: "latitude".to_owned(), value: "north".to_owned() },
            ),
        ] {
            match read_projector_info(text) {
                Err(MapError::ProjectorInfo { line: found_line, problem: found }) => {
                    assert_eq!((found_line, found), (line, problem), "{text:?}");
                }
                other => assert!(other.is_err(), "{text:?} gave {other:?}"),
            }
        }
    }
}
