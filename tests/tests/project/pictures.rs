//! The pictures on the pages equal the output of core's examples.

use std::error::Error;

use hapterra_tests::repository;

#[path = "../../../core/examples/shaded_force.rs"]
#[expect(dead_code, reason = "the example's own main")]
mod shaded_force;
#[path = "../../../core/examples/stick_slip.rs"]
#[expect(dead_code, reason = "the example's own main")]
mod stick_slip;
#[path = "../../../core/examples/textured_force.rs"]
#[expect(dead_code, reason = "the example's own main")]
mod textured_force;

/// Tolerance of a line, pixels: on another machine a tangent may round to the next tenth.
const OFF: f64 = 0.11;

fn assert_committed(drawn: Result<String, Box<dyn Error>>, example: &str, file: &str) {
    let drawn = drawn.expect("it is drawn");
    let committed = std::fs::read_to_string(repository().join("docs").join(file));
    let committed = committed.expect("readable");
    assert!(
        is_same(drawn.trim_end(), committed.trim_end()),
        "type: cargo run -p hapterra-core --example {example} > docs/{file}"
    );
}

/// Returns true if two pictures have the same words, and numbers equal within [`OFF`].
fn is_same(one: &str, other: &str) -> bool {
    let words = |text: &str| -> Vec<String> {
        let words = text.split([' ', ',', '"', '<', '>', '\n']);
        words.map(str::to_owned).collect()
    };
    let (one, other) = (words(one), words(other));
    let alike = |(one, other): (&String, &String)| match (one.parse::<f64>(), other.parse::<f64>())
    {
        (Ok(one), Ok(other)) => (one - other).abs() < OFF,
        _ => one == other,
    };
    one.len() == other.len() && one.iter().zip(&other).all(alike)
}

#[test]
fn friction_picture_is_that_of_the_example() {
    assert_committed(stick_slip::picture(), "stick_slip", "stick-slip.svg");
}

#[test]
fn shading_picture_is_that_of_the_example() {
    assert_committed(shaded_force::picture(), "shaded_force", "shading.svg");
}

#[test]
fn texture_picture_is_that_of_the_example() {
    assert_committed(textured_force::picture(), "textured_force", "texture.svg");
}

#[test]
fn altered_picture_is_detected() {
    let line = |points: &str| format!("<polyline points=\"{points}\" stroke=\"#333\"/>");
    assert!(is_same(&line("0.0,1.2 0.5,1.3"), &line("0.0,1.2 0.5,1.4")));
    assert!(!is_same(&line("0.0,1.2 0.5,1.3"), &line("0.0,1.2 0.5,1.6")));
    assert!(!is_same(&line("0.0,1.2 0.5,1.3"), &line("0.0,1.2")));
    assert!(!is_same("<text>HIP</text>", "<text>proxy</text>"));
}
