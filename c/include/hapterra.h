/* Touch a height field from C and C++: millimetres in, newtons out.
 *
 * Frame: x east, y north, z up, from the south-west sample at height zero. An object belongs to one
 * thread at a time. What a function points to stays the caller's, and is used during the call only,
 * unless the function says otherwise.
 *
 * Made by cbindgen from the library: `HAPTERRA_WRITE=1 cargo test -p hapterra-c --test header`. */

#ifndef HAPTERRA_H
#define HAPTERRA_H

#include <stddef.h>
#include <stdint.h>

/**
 * What a function returns: 0, or which error.
 */
enum HapterraStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * All is well.
   */
  HAPTERRA_STATUS_OK = 0,
  /**
   * A pointer is null.
   */
  HAPTERRA_STATUS_NULL_POINTER = 1,
  /**
   * A pointer is not aligned, or a count is larger than memory.
   */
  HAPTERRA_STATUS_BAD_POINTER = 2,
  /**
   * The terrain has no heights yet, or the contact has not begun.
   */
  HAPTERRA_STATUS_NOT_BEGUN = 3,
  /**
   * A terrain of such a size, or with so many samples, cannot be.
   */
  HAPTERRA_STATUS_SIZE = 4,
  /**
   * The millimetres of a cell or of a vertical unit are no scale.
   */
  HAPTERRA_STATUS_SCALE = 5,
  /**
   * Heights are too tall or too steep.
   */
  HAPTERRA_STATUS_HEIGHTS = 6,
  /**
   * A parameter of a surface is out of its bounds.
   */
  HAPTERRA_STATUS_SURFACE = 7,
  /**
   * A material of the terrain is not one of the surfaces.
   */
  HAPTERRA_STATUS_MATERIAL = 8,
  /**
   * No tick rate: 1,000 to 10,000 in whole thousands.
   */
  HAPTERRA_STATUS_RATE = 9,
  /**
   * A place is not a number, or too far away.
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
   * A number is none of an enumeration's.
   */
  HAPTERRA_STATUS_CHOICE = 13,
  /**
   * There is no memory.
   */
  HAPTERRA_STATUS_MEMORY = 14,
  /**
   * The library is at fault. The object cannot be used any more but for its end.
   */
  HAPTERRA_STATUS_INTERNAL = 15,
  /**
   * A tip is no ball that can touch these cells.
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
 * Which normals a force follows.
 */
enum HapterraShading
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Those of the cells: an edge between cells is felt as an edge.
   */
  HAPTERRA_SHADING_NONE = 0,
  /**
   * Normals that turn evenly over the edges.
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
 * What a texture looks like.
 */
enum HapterraTexture
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * None: the surface is even.
   */
  HAPTERRA_TEXTURE_NONE = 0,
  /**
   * Heights at random, in all directions.
   */
  HAPTERRA_TEXTURE_GRAIN = 1,
  /**
   * Ridges one after the other.
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
 * Which row of an array comes first.
 */
enum HapterraRowOrder
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The northernmost, as in images and GeoTIFF.
   */
  HAPTERRA_ROW_ORDER_NORTH_FIRST = 0,
  /**
   * The southernmost.
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
 * What a proxy is doing.
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
   * The surface has come to an end, and the last force fades away.
   */
  HAPTERRA_STATE_FADING = 2,
  /**
   * The HIP is below the surface and has not been above it: no force until it has.
   */
  HAPTERRA_STATE_BELOW_GROUND = 3,
  /**
   * The HIP is in a hole or outside and has not been above the surface: no force.
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
 * One haptic interface point (HIP) over a terrain. Made by `hapterra_contact_new`, it has not begun.
 */
typedef struct HapterraContact HapterraContact;

/**
 * A height field. Made by `hapterra_terrain_new`, it has no heights yet.
 */
typedef struct HapterraTerrain HapterraTerrain;

/**
 * How a surface is rendered. Fill it with `hapterra_surface_default`, then change what you like; it
 * is checked when it is used. 48 bytes.
 */
typedef struct HapterraSurface {
  /**
   * Newtons for a millimetre between HIP and proxy; not negative.
   */
  float stiffness_n_per_mm;
  /**
   * Largest force, N; not negative.
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
   * A `HapterraShading`.
   */
  uint32_t shading;
  /**
   * A `HapterraTexture`.
   */
  uint32_t texture;
  /**
   * How far a texture reaches above and below the surface, mm, 0 to 2, and at most an eighth of
   * its wavelength.
   */
  float texture_amplitude_mm;
  /**
   * From ridge to ridge, mm, 0.25 to 100.
   */
  float texture_wavelength_mm;
  /**
   * In which direction the ridges of a grating follow each other, degrees from east to north.
   */
  float texture_direction_deg;
  /**
   * Which of the textures that are alike.
   */
  uint32_t texture_seed;
} HapterraSurface;

/**
 * Reads heights of a block of samples into `heights`, row by row from the south and each row from
 * west to east: `columns` times `rows`, at most 33 × 33, or 52 × 52 under a tip, NaN for a hole. `column` and `row` count
 * from the south-west sample. Returns 0, or any other number for an error. `user` is the pointer
 * that was given with the function. It is called during calls with a contact or terrain only, and
 * must not end by an exception or `longjmp`.
 */
typedef uint32_t (*HapterraRead)(void *user,
                                 uint32_t column,
                                 uint32_t row,
                                 uint32_t columns,
                                 uint32_t rows,
                                 double *heights);

/**
 * A step's answer. 64 bytes.
 */
typedef struct HapterraStep {
  /**
   * The force on the hand, N: east, north, up. Each is a number of single precision.
   */
  double force_n[3];
  /**
   * The proxy, mm: east, north, up.
   */
  double proxy_mm[3];
  /**
   * The height of the surface over the HIP, mm, in the state `HAPTERRA_STATE_BELOW_GROUND`; NaN in all others.
   */
  double surface_mm;
  /**
   * A `HapterraState`.
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
 * Returns the text of a status, for ever valid; that of `HAPTERRA_STATUS_CHOICE` for any other
 * number. Not to be freed.
 */
const char *hapterra_error_text(uint32_t status);

/**
 * Returns the version of the library, such as `0.1.0`, for ever valid. Not to be freed.
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
 * Ends a terrain; null is left alone. Contacts on it stay as they are.
 */
void hapterra_terrain_free(struct HapterraTerrain *terrain);

/**
 * Gives a terrain `columns` times `rows` heights in millimetres, `cell_mm` apart, row by row in a
 * `HapterraRowOrder`, each row from west to east; NaN is a hole. They are copied. Contacts that
 * have begun keep the terrain that they have.
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
 * As `hapterra_terrain_set_f32`, in double precision.
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
 * Gives a terrain heights in millimetres that a function reads where they are touched. Function and
 * `user` are the caller's, and valid until the terrain and all contacts that began on it have ended.
 * A contact that was moved to another thread calls it from there.
 */
HapterraStatus hapterra_terrain_set_reader(struct HapterraTerrain *terrain,
                                           HapterraRead read,
                                           void *user,
                                           uint32_t columns,
                                           uint32_t rows,
                                           double cell_mm);

/**
 * Says how many millimetres a unit of the heights is, where they are not millimetres. It counts for
 * the heights that the terrain has, and for contacts that begin later.
 */
HapterraStatus hapterra_terrain_set_height_scale(struct HapterraTerrain *terrain,
                                                 double mm_per_unit);

/**
 * Puts a ball of a radius in millimetres in place of the point that touches the terrain, or with 0 the
 * point again. The HIP and the proxy are then the ball's centre, one radius above flat ground, and so
 * is `hapterra_terrain_height_mm`. The radius is at most 8 cells. It counts for the heights that the
 * terrain has, and for contacts that begin later.
 */
HapterraStatus hapterra_terrain_set_tip(struct HapterraTerrain *terrain,
                                        double tip_mm);

/**
 * Says of which material each sample is: the number of one of the surfaces of
 * `hapterra_contact_begin`, row by row in a `HapterraRowOrder`. There are as many as the terrain
 * has samples, and they are copied.
 *
 * # Safety
 * At `materials` are `count` values.
 */
HapterraStatus hapterra_terrain_set_materials(struct HapterraTerrain *terrain,
                                              const uint8_t *materials,
                                              size_t count,
                                              uint32_t order);

/**
 * Returns the height of the surface at a place, mm, or of a ball's centre over it; NaN in a hole, off the terrain, where it cannot
 * be read, and for null.
 */
double hapterra_terrain_height_mm(const struct HapterraTerrain *terrain,
                                  double east_mm,
                                  double north_mm);

/**
 * Returns the message of the terrain's last error, empty where there was none, null for null. It is
 * the terrain's, and valid until the next call with it.
 */
const char *hapterra_terrain_message(const struct HapterraTerrain *terrain);

/**
 * Returns a contact that has not begun, which the caller owns until `hapterra_contact_free`.
 */
struct HapterraContact *hapterra_contact_new(void);

/**
 * Ends a contact; null is left alone.
 */
void hapterra_contact_free(struct HapterraContact *contact);

/**
 * Begins a contact, or begins it anew, on the heights that a terrain has now: `rate_hz` steps a
 * second, 1,000 to 10,000 in whole thousands. The first of the `count` surfaces, 1 to 16, is the
 * surface, and the others are materials of the terrain, of which stiffness, friction, damping and
 * texture count. Surfaces are copied, and the terrain may end before the contact.
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
 * Puts other surfaces in between two steps, as `hapterra_contact_begin` takes them. The proxy stays
 * where it is, and the next force is that of the other surface.
 *
 * # Safety
 * At `surfaces` are `count` values.
 */
HapterraStatus hapterra_contact_set_surface(struct HapterraContact *contact,
                                            const struct HapterraSurface *surfaces,
                                            size_t count);

/**
 * Makes one step with the HIP at three numbers, mm: east, north, up from the south-west sample at
 * height zero. Where it returns an error the step has not happened and `step` is as before. An
 * error gives no force: a program that drives a device has to set its force to zero.
 *
 * # Safety
 * At `hip_mm` are 3 numbers, and at `step` is room for one step.
 */
HapterraStatus hapterra_contact_step(struct HapterraContact *contact,
                                     const double *hip_mm,
                                     struct HapterraStep *step);

/**
 * Makes `count` steps, of three numbers each, one after the other into `steps`. It ends with the
 * first that cannot happen. `done` may be null; else it receives how many steps have happened.
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
 * Returns the message of the contact's last error, empty where there was none, null for null. It is
 * the contact's, and valid until the next call with it.
 */
const char *hapterra_contact_message(const struct HapterraContact *contact);

/**
 * Returns memory of so many bytes, aligned to 16, that the caller owns until `hapterra_free`; null
 * for no bytes, and where there is none. Meant for WebAssembly; C has `malloc`.
 */
void *hapterra_alloc(size_t bytes);

/**
 * Gives memory back that `hapterra_alloc` returned for the same number of bytes. Null is left alone.
 *
 * # Safety
 * `pointer` is null, or came from `hapterra_alloc(bytes)` and has not been given back.
 */
void hapterra_free(void *pointer,
                   size_t bytes);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HAPTERRA_H */
