// GeoTIFF, read by geotiff.js, which is loaded when the first one is dropped.

import { reverseRows } from "../terrain.js";
import { ReadError, metresPerDegree } from "./samples.js";

const LIBRARY = "geotiff.js";
const GEOGRAPHIC = 2;

function library() {
  return new Promise((resolve, reject) => {
    if (globalThis.GeoTIFF) return resolve(globalThis.GeoTIFF);
    const script = document.createElement("script");
    script.src = LIBRARY;
    script.onload = () => resolve(globalThis.GeoTIFF);
    script.onerror = () => reject(new ReadError(`This page was made without ${LIBRARY}, so it cannot read GeoTIFF. Make it again with npm and a network, or convert the file: gdal_translate -of AAIGrid in.tif out.asc.`));
    document.head.append(script);
  });
}

export async function tiff(bytes) {
  const { fromArrayBuffer } = await library();
  const file = await fromArrayBuffer(bytes.slice().buffer);
  const image = await file.getImage();
  const [nx, ny] = [image.getWidth(), image.getHeight()];
  const [band] = await image.readRasters({ samples: [0] });
  const noData = image.getGDALNoData();
  const heights = Float32Array.from(band, (height) => (height === noData ? NaN : height));
  return { nx, ny, heights: reverseRows(heights, nx, ny), cellM: cell(image, ny), unitM: 1 };
}

/** Returns the sides of a cell east and north in metres; null if the file does not state them. */
function cell(image, ny) {
  const hasPlace = image.fileDirectory.hasTag("ModelPixelScale") || image.fileDirectory.hasTag("ModelTransformation");
  if (!hasPlace) return null;
  const [east, north] = image.getResolution().map(Math.abs);
  if (image.getGeoKeys()?.GTModelTypeGeoKey !== GEOGRAPHIC) return [east, north];
  const [metresEast, metresNorth] = metresPerDegree(image.getOrigin()[1] - (north * ny) / 2);
  return [east * metresEast, north * metresNorth];
}
