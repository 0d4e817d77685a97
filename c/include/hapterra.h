/* Touch a height field from C and C++: millimetres in, newtons out.
 *
 * Frame: x east, y north, z up, from the south-west sample at height zero. An object belongs to one
 * thread at a time. Pointers stay the caller's, and are used during the call only, unless the function
 * states otherwise.
 *
 * Made by cbindgen from the library: `HAPTERRA_WRITE=1 cargo test -p hapterra-c --test header`. */

#ifndef HAPTERRA_H
#define HAPTERRA_H

#include <stddef.h>
#include <stdint.h>

/**
 * Result of a function: 0, or an error.
 */
enum HapterraStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Success.
   */
  HAPTERRA_STATUS_OK = 0,
  /**
   * A pointer is null.
   */
  HAPTERRA_STATUS_NULL_POINTER = 1,
  /**
   * A pointer is not aligned, or a count is larger than memory.
   */
  HAPTERRA_STATUS_POINTER = 2,
  /**
   * The terrain has no heights yet, or the contact was not begun.
   */
  HAPTERRA_STATUS_NOT_BEGUN = 3,
  /**
   * The size or the number of samples is not possible.
   */
  HAPTERRA_STATUS_SIZE = 4,
  /**
   * The millimetres of a cell or of a vertical unit are not a valid scale.
   */
  HAPTERRA_STATUS_SCALE = 5,
  /**
   * Heights are too tall or too steep.
   */
  HAPTERRA_STATUS_HEIGHTS = 6,
  /**
   * A parameter of a surface is out of bounds.
   */
  HAPTERRA_STATUS_SURFACE = 7,
  /**
   * A material of the terrain is not one of the surfaces.
   */
  HAPTERRA_STATUS_MATERIAL = 8,
  /**
   * The tick rate is not 1,000 to 10,000 in whole thousands.
   */
  HAPTERRA_STATUS_RATE = 9,
  /**
   * A position is not a number, or too far away.
   */
  HAPTERRA_STATUS_PLACE = 10,
  /**
   * The reader of heights returned an error.
   */
  HAPTERRA_STATUS_UNREAD = 11,
  /**
   * A path is too long for one step.
   */
  HAPTERRA_STATUS_FAR = 12,
  /**
   * A number is not a value of its enumeration.
   */
  HAPTERRA_STATUS_CHOICE = 13,
  /**
   * Memory could not be allocated.
   */
  HAPTERRA_STATUS_MEMORY = 14,
  /**
   * A defect of the library. The object can only be freed.
   */
  HAPTERRA_STATUS_INTERNAL = 15,
  /**
   * The radius of a tip is not possible on these cells.
   */
  HAPTERRA_STATUS_TIP = 16,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum HapterraStatus HapterraStatus;
#else
typedef uint32_t HapterraStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The normals that the force's direction follows.
 */
enum HapterraShading
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Normals of the cells: the force's direction changes abruptly where two cells meet.
   */
  HAPTERRA_SHADING_NONE = 0,
  /**
   * Normals that change gradually from cell to cell.
   */
  HAPTERRA_SHADING_SMOOTH = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum HapterraShading HapterraShading;
#else
typedef uint32_t HapterraShading;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The pattern of a texture.
 */
enum HapterraTexture
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * None: the surface is smooth.
   */
  HAPTERRA_TEXTURE_NONE = 0,
  /**
   * Random heights, in all directions.
   */
  HAPTERRA_TEXTURE_GRAIN = 1,
  /**
   * Parallel ridges.
   */
  HAPTERRA_TEXTURE_GRATING = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum HapterraTexture HapterraTexture;
#else
typedef uint32_t HapterraTexture;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The order of the rows of an array.
 */
enum HapterraRowOrder
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The first row is the northernmost, as in images and GeoTIFF.
   */
  HAPTERRA_ROW_ORDER_NORTH_FIRST = 0,
  /**
   * The first row is the southernmost.
   */
  HAPTERRA_ROW_ORDER_SOUTH_FIRST = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum HapterraRowOrder HapterraRowOrder;
#else
typedef uint32_t HapterraRowOrder;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The state of a proxy.
 */
enum HapterraState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The HIP is in the air: no force.
   */
  HAPTERRA_STATE_FREE = 0,
  /**
   * The proxy is on the surface and the HIP below it.
   */
  HAPTERRA_STATE_TOUCHING = 1,
  /**
   * The surface has ended, and the last force ramps down.
   */
  HAPTERRA_STATE_RELEASING = 2,
  /**
   * The HIP is below the surface and has not been above it yet: no force until then.
   */
  HAPTERRA_STATE_BELOW_GROUND = 3,
  /**
   * The HIP is in a no-data area or outside, and has not been above the surface yet: no force.
   */
  HAPTERRA_STATE_OUTSIDE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum HapterraState HapterraState;
#else
typedef uint32_t HapterraState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * One haptic interface point (HIP) over a terrain, created by `hapterra_contact_new` and not
 * begun.
 */
typedef struct HapterraContact HapterraContact;

/**
 * A height field, created by `hapterra_terrain_new` without heights.
 */
typedef struct HapterraTerrain HapterraTerrain;

/**
 * The parameters of a surface. Fill it with `hapterra_surface_default`, then change fields; it is
 * checked when it is used. 48 bytes.
 */
typedef struct HapterraSurface {
  /**
   * Stiffness, N/mm; not negative.
   */
  float stiffness_n_per_mm;
  /**
   * Maximum force, N; not negative.
   */
  float max_force_n;
  /**
   * Coulomb's coefficient at rest, 0 to 10, not less than the dynamic one.
   */
  float static_friction;
  /**
   * Coulomb's coefficient while the proxy slides, 0 to 10.
   */
  float dynamic_friction;
  /**
   * Viscous friction over stiffness, s, 0 to 1.
   */
  float viscous_friction_s;
  /**
   * Damping along the force, N·s/m, 0 to 20.
   */
  float damping_ns_per_m;
  /**
   * A value of `HapterraShading`.
   */
  uint32_t shading;
  /**
   * A value of `HapterraTexture`.
   */
  uint32_t texture;
  /**
   * Height of a texture above and below the surface, mm, 0 to 2, and at most an eighth of
   * its wavelength.
   */
  float texture_amplitude_mm;
  /**
   * Wavelength of a texture, mm, 0.25 to 100.
   */
  float texture_wavelength_mm;
  /**
   * Direction across the ridges of a grating, degrees from east to north.
   */
  float texture_direction_deg;
  /**
   * Seed of a texture: selects a variant of the same pattern.
   */
  uint32_t texture_seed;
} HapterraSurface;

/**
 * Reads heights of a block of samples into `heights`, row by row from the south and each row from
 * west to east: `columns` times `rows`, at most 33 × 33, or 52 × 52 under a tip, NaN for no-data.
 * `column` and `row` count from the south-west sample. Returns 0, or any other number for an
 * error. `user` is the pointer that was passed with the function. The function is only called
 * during calls with a contact or terrain, and must not end by an exception or `longjmp`.
 */
typedef uint32_t (*HapterraRead)(void *user,
                                 uint32_t column,
                                 uint32_t row,
                                 uint32_t columns,
                                 uint32_t rows,
                                 double *heights);

/**
 * The result of a step. 64 bytes.
 */
typedef struct HapterraStep {
  /**
   * The force on the hand, N: east, north, up. Each has single precision.
   */
  double force_n[3];
  /**
   * The proxy, mm: east, north, up.
   */
  double proxy_mm[3];
  /**
   * The height of the surface over the HIP, mm, in the state `HAPTERRA_STATE_BELOW_GROUND`; NaN
   * in all others.
   */
  double surface_mm;
  /**
   * A value of `HapterraState`.
   */
  uint32_t state;
  /**
   * 0.
   */
  uint32_t reserved;
} HapterraStep;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Returns the text of a status, valid forever; for any other number the text of
 * `HAPTERRA_STATUS_CHOICE`. Not to be freed.
 */
const char *hapterra_error_text(uint32_t status);

/**
 * Returns the version of the library, such as `0.1.0`, valid forever. Not to be freed.
 */
const char *hapterra_version(void);

/**
 * Fills a surface with the defaults: 0.5 N/mm, 8.5 N, without friction, damping and texture.
 * Returns `HAPTERRA_STATUS_NULL_POINTER` for null.
 */
HapterraStatus hapterra_surface_default(struct HapterraSurface *surface);

/**
 * Returns a terrain without heights, which the caller owns until `hapterra_terrain_free`.
 */
struct HapterraTerrain *hapterra_terrain_new(void);

/**
 * Frees a terrain; null is ignored. Its contacts stay valid.
 */
void hapterra_terrain_free(struct HapterraTerrain *terrain);

/**
 * Sets `columns` times `rows` heights in millimetres, `cell_mm` apart, row by row in a
 * `HapterraRowOrder`, each row from west to east; NaN is no-data. The heights are copied. Contacts
 * that have begun keep their terrain.
 *
 * # Safety
 * At `heights` are `columns` times `rows` values.
 */
HapterraStatus hapterra_terrain_set_f32(struct HapterraTerrain *terrain,
                                        const float *heights,
                                        uint32_t columns,
                                        uint32_t rows,
                                        double cell_mm,
                                        uint32_t row_order);

/**
 * Sets heights as `hapterra_terrain_set_f32` does, in double precision.
 *
 * # Safety
 * At `heights` are `columns` times `rows` values.
 */
HapterraStatus hapterra_terrain_set_f64(struct HapterraTerrain *terrain,
                                        const double *heights,
                                        uint32_t columns,
                                        uint32_t rows,
                                        double cell_mm,
                                        uint32_t row_order);

/**
 * Sets a function that reads heights in millimetres where they are touched. The caller owns the
 * function and `user`, which must stay valid until the terrain and all contacts that began on it
 * are freed. A contact that was moved to another thread calls the function there.
 */
HapterraStatus hapterra_terrain_set_reader(struct HapterraTerrain *terrain,
                                           HapterraRead read,
                                           void *user,
                                           uint32_t columns,
                                           uint32_t rows,
                                           double cell_mm);

/**
 * Sets the millimetres of a unit of the heights, if they are not in millimetres. Applies to the
 * current heights, and to contacts that begin later.
 */
HapterraStatus hapterra_terrain_set_height_scale(struct HapterraTerrain *terrain,
                                                 double mm_per_unit);

/**
 * Sets the radius of the ball that touches the terrain, mm; 0 for a point. The HIP and the proxy
 * are then the ball's centre, one radius above flat ground, and so is
 * `hapterra_terrain_height_mm`. The radius is at most 8 cells. Applies to the current heights, and
 * to contacts that begin later.
 */
HapterraStatus hapterra_terrain_set_tip(struct HapterraTerrain *terrain, double tip_mm);

/**
 * Sets the material of each sample: the index of one of the surfaces of `hapterra_contact_begin`,
 * row by row in a `HapterraRowOrder`. `count` is the number of samples of the terrain. The
 * materials are copied.
 *
 * # Safety
 * At `materials` are `count` values.
 */
HapterraStatus hapterra_terrain_set_materials(struct HapterraTerrain *terrain,
                                              const uint8_t *materials,
                                              size_t count,
                                              uint32_t order);

/**
 * Returns the height of the surface at a position, mm, or of a ball's centre over it; NaN for
 * no-data, outside the terrain, if it cannot be read, and for null.
 */
double hapterra_terrain_height_mm(const struct HapterraTerrain *terrain,
                                  double east_mm,
                                  double north_mm);

/**
 * Returns the message of the terrain's last error, empty if there was none, null for null. The
 * terrain owns the message, which is valid until the next call with it.
 */
const char *hapterra_terrain_message(const struct HapterraTerrain *terrain);

/**
 * Returns a contact that has not begun, which the caller owns until `hapterra_contact_free`.
 */
struct HapterraContact *hapterra_contact_new(void);

/**
 * Frees a contact; null is ignored.
 */
void hapterra_contact_free(struct HapterraContact *contact);

/**
 * Begins or restarts a contact on the current heights of a terrain: `rate_hz` steps a second,
 * 1,000 to 10,000 in whole thousands. The first of the `count` surfaces, 1 to 16, is the surface.
 * The others are materials of the terrain, of which only stiffness, friction, damping and texture
 * are used. Surfaces are copied, and the terrain may be freed before the contact.
 *
 * # Safety
 * At `surfaces` are `count` values.
 */
HapterraStatus hapterra_contact_begin(struct HapterraContact *contact,
                                      const struct HapterraTerrain *terrain,
                                      const struct HapterraSurface *surfaces,
                                      size_t count,
                                      uint32_t rate_hz);

/**
 * Changes the surfaces between two steps; the arguments are as in `hapterra_contact_begin`. The
 * proxy stays where it is, and the next step has the force of the new surface.
 *
 * # Safety
 * At `surfaces` are `count` values.
 */
HapterraStatus hapterra_contact_set_surface(struct HapterraContact *contact,
                                            const struct HapterraSurface *surfaces,
                                            size_t count);

/**
 * Makes one step with the HIP at three numbers, mm: east, north, up from the south-west sample at
 * height zero. After an error the contact and `step` are unchanged. An error has no force: a
 * program that drives a device must set its force to zero.
 *
 * # Safety
 * At `hip_mm` are 3 numbers, and at `step` is room for one step.
 */
HapterraStatus hapterra_contact_step(struct HapterraContact *contact,
                                     const double *hip_mm,
                                     struct HapterraStep *step);

/**
 * Makes `count` steps, of three numbers each, and stores their results in `steps`. Stops at the
 * first step that is not possible. `done` receives the number of steps made, unless it is null.
 *
 * # Safety
 * At `hips_mm` are 3 times `count` numbers, and at `steps` is room for `count` steps.
 */
HapterraStatus hapterra_contact_run(struct HapterraContact *contact,
                                    const double *hips_mm,
                                    size_t count,
                                    struct HapterraStep *steps,
                                    size_t *done);

/**
 * Returns the message of the contact's last error, empty if there was none, null for null. The
 * contact owns the message, which is valid until the next call with it.
 */
const char *hapterra_contact_message(const struct HapterraContact *contact);

/**
 * Returns memory of `bytes` bytes, aligned to 16, that the caller owns until `hapterra_free`; null
 * for no bytes, and if there is no memory. For WebAssembly; C has `malloc`.
 */
void *hapterra_alloc(size_t bytes);

/**
 * Frees memory that `hapterra_alloc` returned for the same number of bytes. Null is ignored.
 *
 * # Safety
 * `pointer` is null, or a result of `hapterra_alloc(bytes)` that was not freed.
 */
void hapterra_free(void *pointer, size_t bytes);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HAPTERRA_H */
