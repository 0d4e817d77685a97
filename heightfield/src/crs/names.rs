//! Datums by the names that texts give them: Esri's texts have no codes.

/// Names of datums that have a shift, as EPSG, GDAL and Esri write them, and the code of the
/// geographic system of each; letters and digits only.
const DATUMS: [(&str, u16); 63] = [
    ("northamerican1927", 4267),
    ("northamericandatum1927", 4267),
    ("european1950", 4230),
    ("europeandatum1950", 4230),
    ("european1987", 4231),
    ("europeandatum1987", 4231),
    ("nouvelletriangulationfrancaise", 4275),
    ("ntf", 4275),
    ("ordnancesurveyofgreatbritain1936", 4277),
    ("osgb1936", 4277),
    ("deutscheshauptdreiecksnetz", 4314),
    ("mgi", 4312),
    ("militargeographischeinstitut", 4312),
    ("ch1903", 4149),
    ("amersfoort", 4289),
    ("belge1950", 4215),
    ("reseaunationalbelge1950", 4215),
    ("belge1972", 4313),
    ("reseaunationalbelge1972", 4313),
    ("pulkovo1942", 4284),
    ("pulkovo1995", 4200),
    ("tokyo", 4301),
    ("southamerican1969", 4618),
    ("southamericandatum1969", 4618),
    ("provisionalsamerican1956", 4248),
    ("provisionalsouthamericandatum1956", 4248),
    ("corregoalegre", 4225),
    ("corregoalegre197072", 4225),
    ("bogota", 4218),
    ("bogota1975", 4218),
    ("arc1950", 4209),
    ("arc1960", 4210),
    ("adindan", 4201),
    ("cape", 4222),
    ("ainelabd1970", 4204),
    ("australian1966", 4202),
    ("australiangeodeticdatum1966", 4202),
    ("australian1984", 4203),
    ("australiangeodeticdatum1984", 4203),
    ("newzealand1949", 4272),
    ("newzealandgeodeticdatum1949", 4272),
    ("montemario", 4265),
    ("sjtsk", 4156),
    ("systemoftheunifiedtrigonometricalcadastralnetwork", 4156),
    ("tm65", 4299),
    ("tm75", 4300),
    ("geodeticdatumof1965", 4300),
    ("ggrs1987", 4121),
    ("greekgeodeticreferencesystem1987", 4121),
    ("wgs1972", 4322),
    ("worldgeodeticsystem1972", 4322),
    ("datum73", 4274),
    ("lisbon", 4207),
    ("lisbon1937", 4207),
    ("hungarian1972", 4237),
    ("hungariandatum1972", 4237),
    ("hutzushan", 4236),
    ("hutzushan1950", 4236),
    ("kkj", 4123),
    ("kartastokoordinaattijarjestelma1966", 4123),
    ("rt1990", 4124),
    ("riketskoordinatsystem1990", 4124),
    ("luxembourgreferenceframe", 4181),
];

/// Prime meridians that EPSG and Esri write behind a datum's name.
const MERIDIANS: [&str; 4] = ["paris", "rome", "bern", "ferro"];

/// The code of the geographic system with a datum of a name, from Greenwich.
pub(super) fn code_of_datum(name: &str) -> Option<u16> {
    let name = name.strip_prefix("D_").unwrap_or(name);
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    let plain = plain.to_ascii_lowercase();
    let plain = MERIDIANS
        .iter()
        .find_map(|meridian| plain.strip_suffix(meridian))
        .unwrap_or(&plain);
    let found = DATUMS.iter().find(|(name, _)| *name == plain);
    found.map(|(_, code)| *code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn esri_gdal_and_epsg_write_the_same_datum() {
        for name in [
            "D_North_American_1927",
            "North_American_Datum_1927",
            "North American Datum 1927",
        ] {
            assert_eq!(code_of_datum(name), Some(4267), "{name}");
        }
        assert_eq!(code_of_datum("D_NTF_Paris"), Some(4275));
        for name in ["", "D_", "Moon 2000", "Not_specified"] {
            assert_eq!(code_of_datum(name), None, "{name}");
        }
    }
}
