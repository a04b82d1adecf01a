//! A parking plan as one HTML page: the scene from above, the swept way coloured by gear, the vehicle at any time, and
//! its speed, curvature and steering over time. Nothing is loaded from elsewhere.

use super::document::Document;
use super::parking::ParkingReport;
use open_space::collision::Rectangle;
use open_space::{PlanarPose, Problem};
use serde::Serialize;

const DOCUMENT: Document = Document {
    style: include_str!("parking_page/style.css"),
    body: include_str!("parking_page/body.html"),
    viewer: include_str!("parking_page/viewer.js"),
};

/// What the viewer reads. Metres and radians.
#[derive(Debug, Serialize)]
struct OnPage<'a> {
    /// x of the front and the rear, y of the left and the right side, from the reference point.
    vehicle: [f64; 4],
    wheel_base: f64,
    bounds: [f64; 4],
    obstacles: Vec<Vec<[f64; 2]>>,
    start: [f64; 3],
    goal: [f64; 3],
    plan: &'a ParkingReport,
}

/// The page.
///
/// # Errors
/// The report has no JSON form.
pub fn write(problem: &Problem, report: &ParkingReport) -> Result<String, serde_json::Error> {
    let Rectangle { front_m, rear_m, left_m, right_m } = Rectangle::of(&problem.vehicle);
    let pose = |pose: &PlanarPose| [pose.x, pose.y, pose.yaw];
    let data = OnPage {
        vehicle: [front_m, rear_m, left_m, right_m],
        wheel_base: problem.vehicle.wheel_base_m(),
        bounds: problem.bounds,
        obstacles: problem
            .obstacles
            .iter()
            .map(|line| line.iter().map(|point| [point.x, point.y]).collect())
            .collect(),
        start: pose(&problem.start),
        goal: pose(&problem.goal),
        plan: report,
    };
    DOCUMENT.write(&format!("park – {}", report.scene()), &data)
}
