//! Pictures hold what they promise, whatever the scene.

use super::*;
use crate::json::Number;
use crate::report::explanation;
use crate::report::filter_pictures::Still;
use quick_look::elements;

/// As much of XML as these pictures use.
mod quick_look {
    /// Names of the elements in order; panics where tags do not match.
    pub(super) fn elements(text: &str) -> Vec<String> {
        let (mut names, mut open) = (Vec::new(), Vec::new());
        for piece in text.split('<').skip(1) {
            let (tag, _) = piece.split_once('>').unwrap();
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop().as_deref(), Some(name), "tags match");
                continue;
            }
            let name = tag.split([' ', '/']).next().unwrap().to_owned();
            if !tag.ends_with('/') {
                open.push(name.clone());
            }
            names.push(name);
        }
        assert!(open.is_empty(), "{open:?}");
        names
    }
}

fn explained(still: &Still) -> Explanation {
    let (validator, verdicts) = still.judge().unwrap();
    explanation::explain(&validator, &still.candidates, &verdicts, 1, "anchor", still.scene.now)
}

fn drawn(still: &Still, explanation: &Explanation, focus: usize) -> String {
    let (scene, candidates) = (&still.scene, &still.candidates[..]);
    draw(&Subject { title: "a <title>", scene, candidates, explanation, focus })
}

fn still(filter: &str) -> Still {
    Still::all().into_iter().find(|still| still.filter == filter).unwrap()
}

#[test]
fn a_rejection_shows_its_place_its_time_and_its_words() {
    let still = still("traffic_light_filter");
    let explanation = explained(&still);
    let picture = drawn(&still, &explanation, 0);
    elements(&picture);
    for part in
        ["class=\"mark\"", "red-lamp", "front bumper crosses stop line", "is rejected", "a &lt;title&gt;"]
    {
        assert!(picture.contains(part), "{part}");
    }
    let evidence = explanation.candidates[0].judgements.iter().find(|j| !j.feasible).unwrap();
    let time = evidence.evidence.as_ref().unwrap().time_s.unwrap();
    assert!(picture.contains(&format!(">{:.1} s<", time.0)));
    let accepted = drawn(&still, &explanation, 1);
    assert!(!accepted.contains("class=\"hit\"") && accepted.contains("is accepted"));
}

#[test]
fn the_worst_candidate_is_looked_at() {
    let still = still("crosswalk_filter");
    let mut explanation = explained(&still);
    assert_eq!(worst(&explanation), 0);
    explanation.candidates.reverse();
    assert_eq!(worst(&explanation), 1);
    let shadow = &mut explanation.candidates[1];
    shadow.accepted = true;
    assert_eq!(worst(&explanation), 1, "nobody is rejected, a shadow filter objects");
    explanation.candidates.clear();
    assert_eq!(worst(&explanation), 0);
}

#[test]
fn nothing_at_all_can_be_drawn() {
    let mut still = still("crosswalk_filter");
    still.scene = Scene::empty(still.scene.now, still.scene.vehicle.clone());
    still.candidates.clear();
    let explanation = Explanation { candidates: Vec::new(), ..explained(&still) };
    elements(&drawn(&still, &explanation, 7));
}

#[test]
fn numbers_that_are_none_are_not_drawn() {
    let mut still = still("collision_check_filter");
    let mut message = (*still.candidates[0].message).clone();
    message.points[3].pose.position.x = f64::NAN;
    message.points[4].pose.position.y = f64::INFINITY;
    still.candidates[0] = Candidate::new(message.into(), "broken".into(), 0);
    let mut objects = (**still.scene.objects.as_ref().unwrap()).clone();
    objects.objects[0].kinematics.predicted_paths[0].path[2].position.x = f64::NAN;
    objects.objects.push(objects.objects[0].clone());
    objects.objects[1].kinematics.initial_pose_with_covariance.pose.position.y = f64::NAN;
    still.scene.objects = Some(objects.into());
    let mut explanation = explained(&still);
    if let Some(evidence) = explanation.candidates[0].judgements[0].evidence.as_mut() {
        evidence.x = Some(Number(f64::NAN));
    }
    let picture = drawn(&still, &explanation, 0);
    elements(&picture);
    let drawing = picture.split_once("</style>").unwrap().1;
    for word in ["NaN", "inf\"", "infL", " inf"] {
        assert!(!drawing.contains(word), "{word}");
    }
}

#[test]
fn a_place_beyond_all_others_keeps_the_picture_small() {
    let mut still = still("out_of_lane_filter");
    let mut message = (*still.candidates[0].message).clone();
    for (step, point) in message.points.iter_mut().enumerate() {
        point.pose.position.x += 1e4 * step as f64;
    }
    still.candidates = vec![Candidate::new(message.into(), "far".into(), 0)];
    let mut explanation = explained(&still);
    still.candidates = vec![still.candidates[0].clone(); 300];
    explanation.candidates = vec![explanation.candidates[0].clone(); 300];
    assert!(drawn(&still, &explanation, 0).len() < 60_000);
}
