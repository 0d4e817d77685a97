//! Input devices, settings and sounds of the page.

use serde_json::json;

use crate::site::{Site, one, px};

/// Returns a page with a ramp, up to the east by one in two.
fn site_on_a_ramp() -> Option<Site> {
    let mut site = Site::open(None)?;
    let row: String = (0..61).map(|i| format!("{} ", 25 * i)).collect();
    let rows = format!("{row}\n").repeat(41);
    let head = "ncols 61\nnrows 41\nxllcorner 0\nyllcorner 0\ncellsize 50\n";
    site.drop_file("ramp.asc", format!("{head}{rows}").as_bytes());
    site.wait("hapterra.touch.terrain.name === 'ramp.asc'");
    Some(site)
}

#[test]
fn mouse_moves_presses_and_turns_the_view() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    site.point([0.4, 0.5]);
    site.wait("hapterra.touch.state === 'touching'");
    let from = site.value("hapterra.touch.arm.hand[0]").as_f64();
    site.point([0.6, 0.5]);
    site.wait(&format!(
        "hapterra.touch.arm.hand[0] > {} + 20",
        from.expect("mm")
    ));
    let [x, y] = px([0.6, 0.5]);
    let wheel = |up: f64| json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": -100.0 * up });
    site.input("Mouse", wheel(1.0));
    site.wait("hapterra.touch.arm.pressN === 1.2");
    for _ in 0..6 {
        site.input("Mouse", wheel(-1.0));
    }
    site.wait("hapterra.touch.arm.pressN === 0 && hapterra.touch.state === 'free'");
    let yaw = site.value("hapterra.scene.camera.yaw").as_f64();
    let button = |kind: &str, x: f64| json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 });
    site.input("Mouse", button("mousePressed", x));
    site.input("Mouse", button("mouseMoved", x + 40.0));
    site.wait(&format!(
        "hapterra.scene.camera.yaw > {} + 0.1",
        yaw.expect("an angle")
    ));
    site.input("Mouse", button("mouseReleased", x + 40.0));
}

#[test]
fn finger_presses_while_it_is_down() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    site.slide("press", 0.0);
    site.wait("hapterra.touch.state === 'free' && hapterra.touch.arm.pressN === 0");
    let at = |place: [f64; 2]| {
        let [x, y] = px(place);
        json!([{ "x": x, "y": y }])
    };
    let touch = |kind: &str, points| json!({ "type": kind, "touchPoints": points });
    site.input("Touch", touch("touchStart", at([0.4, 0.5])));
    site.wait("hapterra.touch.arm.pressN === 1 && hapterra.touch.state === 'touching' && hapterra.touch.force[2] > 0.5");
    let from = site.value("hapterra.touch.arm.hand[0]").as_f64();
    site.input("Touch", touch("touchMove", at([0.6, 0.5])));
    site.wait(&format!(
        "hapterra.touch.arm.hand[0] > {} + 20",
        from.expect("mm")
    ));
    site.input("Touch", touch("touchEnd", json!([])));
    site.wait("hapterra.touch.arm.pressN === 0 && hapterra.touch.state === 'free'");
}

#[test]
fn gamepad_moves_turns_and_presses() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    // The left stick to the right and forward, the right one to the right, half of the right
    // trigger.
    let _ = site.value(
        "(() => {
            const buttons = Array.from({ length: 17 }, (_, i) => ({ value: i === 7 ? 0.5 : 0 }));
            const pad = { connected: true, axes: [0.5, -0.5, 0.5, 0], buttons };
            Object.defineProperty(navigator, 'getGamepads', { value: () => [null, pad] });
        })()",
    );
    let edges = "(({ arm, terrain }) => arm.pointer[0] === terrain.widthMm - 4 && arm.pointer[1] === terrain.depthMm - 4)(hapterra.touch)";
    site.wait(edges);
    site.wait("hapterra.touch.arm.pressN === 2 && hapterra.touch.state === 'touching'");
    site.wait("hapterra.scene.camera.yaw > 1");
}

/// Returns the sound of a force and its change: Hz, and its volume.
fn received(site: &mut Site, newtons: f64, change: f64) -> [f64; 2] {
    let value = site.value(&format!(
        "import('./js/sound.js').then(async ({{ Sound }}) => {{
            const offline = new OfflineAudioContext(1, 44100, 44100);
            offline.resume = () => {{}};
            const sound = new Sound(() => offline);
            sound.toggle();
            sound.update({newtons}, {change});
            const data = (await offline.startRendering()).getChannelData(0).subarray(22050);
            const ups = data.filter((now, i) => i > 0 && data[i - 1] < 0 && now >= 0).length;
            return [2 * ups, Math.hypot(...data.filter((_, i) => i % 4 === 0)) / Math.sqrt(data.length / 4)];
        }})"
    ));
    [0, 1].map(|at| value[at].as_f64().unwrap_or_else(|| panic!("{value}")))
}

#[test]
fn sound_follows_the_force_and_its_changes() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    let [_, silence] = received(&mut site, 0.0, 0.0);
    let [one_hz, one_newton] = received(&mut site, 1.0, 0.0);
    let [two_hz, two_newtons] = received(&mut site, 2.0, 0.0);
    let [_, rustle] = received(&mut site, 0.0, 0.04);
    let found = (silence, one_hz, one_newton, two_hz, two_newtons, rustle);
    assert!(silence < 1e-3, "{found:?}");
    assert!(
        (one_hz - 140.0).abs() < 4.0 && (two_hz - 195.0).abs() < 4.0,
        "{found:?}"
    );
    assert!((two_newtons / one_newton - 2.0).abs() < 0.1, "{found:?}");
    assert!(rustle > 0.01, "{found:?}");
    // In the page a click enables the sound; a browser without a sound device may be silent.
    let place = site.value(
        "(({ x, y, width, height }) => [x + width / 2, y + height / 2])(document.getElementById('sound').getBoundingClientRect())",
    );
    for kind in ["mousePressed", "mouseReleased"] {
        let click = json!({ "type": kind, "x": place[0], "y": place[1], "button": "left", "clickCount": 1 });
        site.input("Mouse", click);
    }
    site.wait(
        "hapterra.sound.isOn && document.getElementById('sound').textContent === 'Sound off'",
    );
}

#[test]
fn ball_rests_by_its_radius_and_is_drawn_in_its_size() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    let mut pixels = vec![];
    for tip_mm in [0.0, 2.0, 7.0] {
        let hand = site.value("hapterra.touch.arm.pointer");
        site.slide("tip", tip_mm);
        assert_eq!(site.value("hapterra.touch.tipMm"), tip_mm);
        assert!(
            hand.is_array() && site.text("tip-is").contains(&tip_mm.to_string()) == (tip_mm > 0.0)
        );
        site.point([0.5, 0.5]);
        site.wait(
            "hapterra.touch.state === 'touching' && Math.hypot(...hapterra.touch.arm.speed) < 0.01",
        );
        // Over a slope of one in two the centre is √1.25 radii above the ground.
        let above = site.value("(([x, , z]) => z - x / 2)(hapterra.touch.proxy)");
        let above = above.as_f64().expect("mm");
        let expected = 1.25_f64.sqrt() * tip_mm;
        assert!(
            (above - expected).abs() < 0.02 * tip_mm + 1e-3,
            "{above}, not {expected}"
        );
        pixels.push(site.pixels_near_the_ball().near[0]);
    }
    assert!(
        pixels[0] > 0 && 4 * pixels[0] < pixels[2] && 3 * pixels[1] < pixels[2],
        "{pixels:?}"
    );
}

#[test]
fn tip_change_keeps_the_position_of_the_hand() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    site.point([0.5, 0.5]);
    site.wait(
        "hapterra.touch.state === 'touching' && Math.hypot(...hapterra.touch.arm.speed) < 0.01",
    );
    // Between two frames: the arm's position, the ticks until it touches again, and no change after
    // a refused radius.
    let found = site.value(
        "(() => {
            const { touch } = hapterra;
            const before = [...touch.arm.at];
            touch.setTip(6);
            const lifted = touch.arm.at.map((mm, axis) => mm - before[axis]);
            let ticks = 0;
            do { touch.tick(); ticks += 1; } while (touch.state !== 'touching' && ticks < 1000);
            let refused = '';
            try { touch.setTip(-1); } catch (why) { refused = why.message; }
            return { lifted, ticks, rows: touch.path.rows, refused, tip: touch.tipMm };
        })()",
    );
    let lifted: Vec<_> = (0..3).map(|axis| found["lifted"][axis].as_f64()).collect();
    assert_eq!(lifted[..2], [Some(0.0); 2], "{found}");
    assert!(lifted[2].is_some_and(|mm| mm > 3.0 && mm < 8.0), "{found}");
    assert!(
        found["ticks"].as_u64().is_some_and(|ticks| ticks < 50),
        "{found}"
    );
    assert_eq!(found["rows"], found["ticks"], "{found}");
    assert_eq!(found["tip"], 6.0, "{found}");
    let refused = found["refused"].as_str().unwrap_or_default();
    assert!(refused.contains("a tip of -1 mm"), "{found}");
}

#[test]
fn slider_of_the_surface_keeps_the_contact() {
    let _one = one();
    let Some(mut site) = site_on_a_ramp() else {
        return;
    };
    site.point([0.5, 0.5]);
    site.wait(
        "hapterra.touch.state === 'touching' && Math.hypot(...hapterra.touch.arm.speed) < 0.01",
    );
    // All ticks between the changes run between two frames. Less friction lets the proxy slide.
    let found = site.value(
        "(() => {
            const { touch } = hapterra;
            const rows = touch.path.rows;
            const states = new Set();
            let jump = 0;
            for (const [id, value] of [['friction', 0.6], ['stiffness', 0.8], ['texture', 0.1], ['friction', 0]]) {
                const slider = document.getElementById(id);
                slider.value = value;
                const { proxy } = touch;
                slider.dispatchEvent(new Event('input'));
                touch.tick();
                if (value > 0) jump = Math.max(jump, Math.hypot(...touch.proxy.map((mm, axis) => mm - proxy[axis])));
                for (let i = 0; i < 100; i++) {
                    states.add(touch.state);
                    touch.tick();
                }
            }
            return { states: [...states], kept: touch.path.rows - rows, jump };
        })()",
    );
    assert_eq!(found["states"], json!(["touching"]), "{found}");
    assert_eq!(found["kept"], 404, "{found}");
    assert!(found["jump"].as_f64().is_some_and(|mm| mm < 0.1), "{found}");
}
