use hapterra_core::contact::Friction;
use hapterra_core::force::Pattern;

use super::*;

fn load(options: SurfaceOptions, text: &str) -> Result<Surface, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("table.toml");
    std::fs::write(&file, text).expect("written");
    let options = SurfaceOptions {
        surface: Some(SurfaceChoice::File(file)),
        ..options
    };
    options.load().map_err(|failure| failure.text())
}

#[test]
fn class_inherits_the_default_and_the_options() {
    let options = SurfaceOptions {
        stiffness: Some(0.7),
        friction: Some(0.2),
        ..SurfaceOptions::default()
    };
    let text = "[default]\nstatic_friction = 0.9\nstiffness = 0.3\ntexture = \"grating\"\ntexture_direction = 20\n[class.3]\nfriction = 0.5\ntexture = \"grain\"\n[class.2]\nstiffness = 0.9\n";
    let surface = load(options, text).expect("a table");
    assert_eq!(surface.params.stiffness_n_per_mm, 0.7);
    assert_eq!(surface.params.friction, Friction::coulomb(0.2));
    let class_materials = surface.class_materials.expect("classes");
    assert_eq!(class_materials.default, Material::of(&surface.params));
    let [two, three] = &class_materials.class[..] else {
        panic!("{class_materials:?}");
    };
    assert_eq!((two.class, three.class), (2, 3));
    assert_eq!(two.material.stiffness_n_per_mm, 0.9);
    assert_eq!(two.material.texture, class_materials.default.texture);
    assert_eq!(three.material.stiffness_n_per_mm, 0.7);
    assert_eq!(three.material.friction, Friction::coulomb(0.5));
    assert_eq!(three.material.texture.pattern, Pattern::Grain);
}

#[test]
fn scene_has_shading_and_passivity() {
    let text = "shading = \"smooth\"\npassivity = \"off\"\n[default]\ndamping = 2\n";
    let params = load(SurfaceOptions::default(), text)
        .expect("a table")
        .params;
    assert_eq!(params.shading, Shading::Smooth);
    assert_eq!(params.damping.controller, Controller::Off);
    assert_eq!(params.damping.ns_per_m, 2.0);
    let params = load(SurfaceOptions::default(), "").expect("nothing").params;
    assert_eq!(params, SurfaceParams::PREMIUM);
}

#[test]
fn numbers_that_no_surface_has_are_refused_with_class_and_line() {
    for (text, expected) in [
        (
            "\n[class.7]\nfriction = -1\n",
            "line 2, class 7: a friction of -1",
        ),
        (
            "[default]\nstiffness = nan",
            "line 1, the default: a stiffness",
        ),
        ("[default]\nstiffness = 0", "[default] has no stiffness"),
        (
            "[class.7]\ndamping = 21",
            "line 1, class 7: a damping of 21",
        ),
        (
            "[class.7]\ntexture_amplitude = 0.1",
            "class 7: texture_amplitude of no texture",
        ),
    ] {
        let why = load(SurfaceOptions::default(), text).expect_err(text);
        assert!(why.contains(expected) && why.contains("hint: "), "{why}");
    }
}

#[test]
fn options_that_no_surface_has_are_refused() {
    let default = SurfaceOptions::default;
    for (options, expected) in [
        (
            SurfaceOptions {
                friction: Some(-0.1),
                ..default()
            },
            "a friction of -0.1",
        ),
        (
            SurfaceOptions {
                friction: Some(f32::NAN),
                ..default()
            },
            "a friction of NaN",
        ),
        (
            SurfaceOptions {
                stiffness: Some(-1.0),
                ..default()
            },
            "a stiffness of -1",
        ),
        (
            SurfaceOptions {
                max_force: Some(-1.0),
                ..default()
            },
            "force of -1",
        ),
    ] {
        let why = options
            .load()
            .map(|it| it.params)
            .expect_err(expected)
            .text();
        assert!(why.contains(expected) && why.contains("hint: "), "{why}");
    }
}

/// Safety: 31.
#[test]
fn table_stiffness_is_limited_by_the_command_line() {
    for (text, reported, allowed) in [
        ("[default]\nstiffness = 3", "line 1: a stiffness of 3", true),
        ("[class.1]\nstiffness = 1.1", "a stiffness of 1.1", true),
        ("[class.1]\nstiffness = 1e30", "at most", false),
    ] {
        let why = load(SurfaceOptions::default(), text).expect_err(text);
        assert!(
            why.contains(reported) && why.contains("--stiffness"),
            "{why}"
        );
        let stiff = SurfaceOptions {
            stiffness: Some(3.0),
            ..SurfaceOptions::default()
        };
        assert_eq!(load(stiff, text).is_ok(), allowed, "{text}");
    }
}

#[test]
fn surface_is_a_name_or_a_file() {
    let read = |word: &str| {
        let command = clap::Command::new("t").arg(clap::Arg::new("s").value_parser(choice()));
        let matches = command.try_get_matches_from(["t", word]);
        matches.map(|it| it.get_one::<SurfaceChoice>("s").cloned())
    };
    let sand = NamedSurface::find("sand").map(SurfaceChoice::Named);
    assert_eq!(read("sand").expect("a name"), sand);
    let file = SurfaceChoice::File("a/b.toml".into());
    assert_eq!(read("a/b.toml").expect("a file"), Some(file));
    let why = read("mud").expect_err("no name").to_string();
    assert!(why.contains("ice, sand, rock"), "{why}");
    let options = SurfaceOptions {
        surface: sand,
        friction: Some(0.7),
        ..SurfaceOptions::default()
    };
    let params = options.load().expect("sand").params;
    assert_eq!(params.friction, Friction::coulomb(0.7));
    assert_eq!(
        (params.stiffness_n_per_mm, params.damping.ns_per_m),
        (0.4, 2.0)
    );
}

#[test]
fn resampling_hint_for_classes_uses_nearest_neighbour() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, cell) in [("a.asc", 10.0), ("b.asc", 17.0)] {
        let header = format!("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize {cell}\n");
        let text = header + "10 80 10\n80 10 80\n";
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let error = Raster::open(folder.path(), &Default::default()).expect_err("two grids");
    let reported = of_classes(error).text();
    assert!(
        reported.contains("gdalwarp -r near -dstnodata"),
        "{reported}"
    );
}

#[test]
fn raster_or_classes_alone_are_refused() {
    let terrain = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
    let with = |materials: Option<&str>, text: Option<&str>| {
        let options = SurfaceOptions {
            materials: materials.map(Into::into),
            ..SurfaceOptions::default()
        };
        let surface = match text {
            Some(text) => load(options.clone(), text).expect("a table"),
            None => options.load().expect("ice"),
        };
        let reading = ReadingOptions::default();
        let materials = surface.materials(&options, ("t.tif", &terrain), &reading);
        materials
            .map(|materials| materials.is_some())
            .map_err(|failure| failure.text())
    };
    assert_eq!(with(None, None), Ok(false));
    assert_eq!(with(None, Some("[default]\nfriction = 0.1")), Ok(false));
    for (materials, text, expected) in [
        (Some("c.tif"), None, "--surface FILE.toml"),
        (None, Some("[class.1]"), "--materials"),
        (Some("no/c.tif"), Some("[class.1]"), "no/c.tif"),
    ] {
        let why = with(materials, text).expect_err("one alone");
        assert!(why.contains(expected) && why.contains("hint: "), "{why}");
    }
    let options = SurfaceOptions {
        surface: Some(SurfaceChoice::File("no/t.toml".into())),
        ..SurfaceOptions::default()
    };
    let why = options
        .load()
        .map(|it| it.params)
        .expect_err("no file")
        .text();
    assert!(why.contains("no/t.toml"), "{why}");
}
