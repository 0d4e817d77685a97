//! GDAL's description of a raster: `cargo run --example gdal_info FILE`.

use heightfield_gdal::{Library, Settings, Window};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).ok_or("name a file")?;
    let gdal = Library::load(Settings::default())?;
    let dataset = gdal.open(file.as_ref(), &[])?;
    println!("{gdal:?}, {dataset:?}");
    println!("geo transform {:?}", dataset.geo_transform());
    for part in dataset.subdatasets() {
        println!("contains {}: {}", part.name, part.title);
    }
    for number in 1..=dataset.bands() {
        let band = dataset.band(number)?;
        let [columns, rows] = band.size();
        println!(
            "band {number}: {columns} × {rows} of {:?}, blocks of {:?}, {} overviews, no data {:?}, {:?}",
            band.sample_type(),
            band.block_size(),
            band.overviews().len(),
            band.no_data(),
            band.mask(),
        );
        let mut corner = [0.0_f64];
        let first = Window {
            column: 0,
            row: 0,
            columns: 1,
            rows: 1,
        };
        band.read(first, &mut corner)?;
        println!("  its first sample is {}", corner[0]);
    }
    Ok(())
}
