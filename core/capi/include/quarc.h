/* C interface of the decoder of .quarc streams (SPEC.md 1.1).
 *
 *   quarc_decoder *decoder = quarc_open();
 *   quarc_state state;
 *   int32_t status;
 *   while (... there are bytes ...) {
 *       quarc_push(decoder, bytes, length);
 *       while ((status = quarc_pull(decoder, &state)) == QUARC_FRAME) { ... }
 *       if (status < 0) { puts(quarc_message(decoder)); break; }
 *   }
 *   quarc_finish(decoder);              then pull to the end once more
 *   quarc_close(&decoder);
 *
 * Every function takes NULL where it takes a pointer, and then does nothing but say
 * QUARC_MISUSE. A decoder is for one thread at a time. Pointers that are given out belong to
 * the decoder; each function says how long they last.
 *
 * Made by cbindgen of core/capi/src; not to be edited.
 */

#ifndef QUARC_H
#define QUARC_H

#include <stddef.h>
#include <stdint.h>

// It is done. Of `quarc_pull`: nothing comes before more bytes are pushed.
#define QUARC_OK 0

// Of `quarc_pull`: the state of the next frame is there.
#define QUARC_FRAME 1

// Of `quarc_pull`, in recovery: a part of the stream is missing here.
#define QUARC_GAP 2

// Of `quarc_pull`: the stream is over, and all that it says is true.
#define QUARC_END 3

// The bytes are no valid stream: `quarc_reject_id` says which rule is broken.
#define QUARC_REJECTED -1

// A stream of the unlimited level asks for more than this decoder gives (SPEC 3.2).
#define QUARC_LIMIT -2

// A pointer is NULL, or the call has no meaning here, as that of a state before the first.
#define QUARC_MISUSE -3

// A fault of the decoder itself; nothing but `quarc_close` makes sense after it.
#define QUARC_BROKEN -4

// Characters of a digest, and the zero behind them.
#define QUARC_DIGEST_SIZE 65

// `changed` of `quarc_splats`: the positions are others than before.
#define QUARC_POSITIONS 1

// `changed` of `quarc_splats`: the rotations are others than before.
#define QUARC_ROTATIONS 2

// `changed` of `quarc_splats`: log-scales, opacities and SH are others than before.
#define QUARC_CODES 4

// A decoder of one stream. Nobody looks into it.
typedef struct quarc_decoder quarc_decoder;

// The integer state of a frame (SPEC 7.1), as it stands in the decoder.
//
// A plane is `count` numbers in a row; each begins `stride` numbers after the one before it:
// the y of Gaussian i is `positions[positions_stride + i]`.
typedef struct {
  // Ordinal of the frame in the stream.
  uint32_t frame;
  // Frames since the canonical one, 0 there.
  uint32_t phase;
  // Gaussians, N.
  size_t count;
  // N ids, ascending.
  const uint32_t *ids;
  // 3 planes: xyz, lattice units.
  const int32_t *positions;
  // From a plane of the positions to the next.
  size_t positions_stride;
  // 4 planes: wxyz of unit quaternions with 22 fraction bits.
  const int32_t *rotations;
  // From a plane of the rotations to the next.
  size_t rotations_stride;
  // `code_planes` planes: log-scale 3, opacity 1, SH DC 3, SH rest 9 or none.
  const int16_t *codes;
  // From a plane of the codes to the next.
  size_t codes_stride;
  // 7 at SH degree 0, 16 at 1.
  size_t code_planes;
} quarc_state;

// What a stream chose for itself (SPEC 5.3), as far as a player needs it.
typedef struct {
  // Frames per second are `timescale / frame_ticks`.
  uint32_t timescale;
  // Ticks from frame to frame.
  uint32_t frame_ticks;
  // The level of the stream: 10, 20, 30, or 31 for none (SPEC 3.2).
  uint32_t level;
  // A position of the state is so many times 2^-lattice_exponent world units.
  uint32_t lattice_exponent;
  // Step of the log-scale codes.
  float log_scale_step;
  // Step of the opacity codes.
  float opacity_step;
  // Step of the codes of SH degree 0.
  float sh_dc_step;
  // Step of the codes of SH degree 1.
  float sh_rest_step;
  // 0 or 1.
  uint32_t sh_degree;
  // 1 if the world is right-handed, else 0.
  uint32_t right_handed;
  // 0 unknown, else 1 to 6 for +x, -x, +y, -y, +z, -z.
  uint32_t up_axis;
  // Size of a world unit; 0 where unknown.
  float meters_per_unit;
  // 1 if frames may change the codes of single Gaussians, else 0: then a Gaussian keeps its
  // codes up to the next canonical frame.
  uint32_t updates;
} quarc_head_info;

// A state in floats (SPEC 10.1), a row to a Gaussian as 3DGS stores it: not activated.
typedef struct {
  // Gaussians, N.
  size_t count;
  // N x 3: xyz, world units.
  const float *positions;
  // N x 4: wxyz, unit to within 2^-21.
  const float *rotations;
  // N x 3: natural logarithms of the standard deviations, world units.
  const float *log_scales;
  // N: logits.
  const float *opacities;
  // N x `sh_coefficients` x 3: red, green, blue of each coefficient.
  const float *sh;
  // 1 at SH degree 0, 4 at 1.
  size_t sh_coefficients;
  // Bits QUARC_POSITIONS, QUARC_ROTATIONS, QUARC_CODES: what differs from the state that was
  // dequantized last; the other arrays are as they were.
  uint32_t changed;
} quarc_splats;

// A part of a damaged stream that was left out (SPEC 11.4).
typedef struct {
  // Where it begins, bytes.
  uint64_t offset;
  // How many bytes it has.
  uint64_t bytes;
  // How many frames are missing for it; -1 where this cannot be told.
  int64_t frames_lost;
  // What was wrong at its beginning, a reject id of SPEC 3.3.
  const char *reject_id;
} quarc_gap_info;

// A text in UTF-8. No zero ends it, and one may stand in it.
typedef struct {
  // Its bytes.
  const uint8_t *bytes;
  // How many.
  size_t length;
} quarc_text;

// A camera of the capture (SPEC 5.6).
typedef struct {
  // As the capture names it.
  quarc_text name;
  // 1 if the encoder left it out of training, else 0.
  uint32_t held_out;
  // Pixels.
  uint32_t width;
  // Pixels.
  uint32_t height;
  // fx and fy, pixels.
  float focal[2];
  // cx and cy, pixels; the center of the first pixel is (0.5, 0.5).
  float center[2];
  // World to camera, row by row.
  float rotation[9];
  // World to camera, world units.
  float translation[3];
  // Least depth of what the camera sees, world units.
  float near;
} quarc_camera_info;

// An entry of the metadata (SPEC 5.7).
typedef struct {
  // Each key stands once.
  quarc_text key;
  // What it says.
  quarc_text value;
} quarc_entry;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of this library, as "1.1.0". The text lasts for ever.
const char *quarc_version(void);

// A decoder that gives the frames of a stream as its bytes come. The caller owns it, and hands
// it to `quarc_close` when done. Never NULL.
quarc_decoder *quarc_open(void);

// The same, of the frames from ordinal `start` on, without decoding what need not be (SPEC 11.2).
// It keeps the whole stream, and gives nothing before `quarc_finish`.
quarc_decoder *quarc_open_seek(uint32_t start);

// The same, of what is left of a damaged stream, and of the gaps in it (SPEC 11.4). It keeps the
// whole stream, and gives nothing before `quarc_finish`.
quarc_decoder *quarc_open_recover(void);

// Free a decoder and all that it has given out, and set the caller's pointer to NULL: a second
// call does nothing, and so does one with NULL.
//
// `decoder` is NULL, or points to NULL or to a decoder that was opened and not closed.
void quarc_close(quarc_decoder **decoder);

// Hand over the next `length` bytes of the stream, in pieces of any size; they are copied.
// Nothing is decoded before `quarc_pull`. QUARC_OK, or QUARC_MISUSE after `quarc_finish`.
//
// `decoder` is NULL or open; `bytes` points to `length` bytes, or `length` is 0.
int32_t quarc_push(quarc_decoder *decoder, const uint8_t *bytes, size_t length);

// Say that no more bytes will come; then pull to the end. QUARC_OK.
//
// `decoder` is NULL or open.
int32_t quarc_finish(quarc_decoder *decoder);

// Go on to the next frame. QUARC_FRAME: `state` has been filled, unless it is NULL; its pointers
// last until the next `quarc_pull` or `quarc_close`, and what they point to must not be written
// to. QUARC_GAP: `quarc_gap` says what is missing. QUARC_OK: push more bytes. QUARC_END. Or what
// is wrong with the stream, again and again; all frames before the fault have been given out.
//
// `decoder` is NULL or open; `state` is NULL or has room.
int32_t quarc_pull(quarc_decoder *decoder, quarc_state *state);

// What the stream chose for itself, once HEAD has been pulled over: before the first frame at the
// latest. QUARC_OK, or QUARC_MISUSE before that. Nothing in `head` points anywhere.
//
// `decoder` is NULL or open; `head` is NULL or has room.
int32_t quarc_head(quarc_decoder *decoder, quarc_head_info *head);

// The SHA-256 of the state that was pulled last (SPEC 9.1), as 64 hexadecimal digits and a zero in
// `digits`, which has room for QUARC_DIGEST_SIZE characters. QUARC_OK, or QUARC_MISUSE where
// there is no state.
//
// `decoder` is NULL or open; `digits` is NULL or has room.
int32_t quarc_digest(quarc_decoder *decoder, char *digits);

// The state that was pulled last, in floats. The pointers last until the next `quarc_dequantize`
// or `quarc_close`, also while the next frame is pulled. QUARC_OK, or QUARC_MISUSE where there
// is no state.
//
// `decoder` is NULL or open; `splats` is NULL or has room.
int32_t quarc_dequantize(quarc_decoder *decoder, quarc_splats *splats);

// What is missing, after QUARC_GAP. `reject_id` lasts until the next `quarc_pull` or
// `quarc_close`. QUARC_OK, or QUARC_MISUSE where the last pull came to no gap.
//
// `decoder` is NULL or open; `gap` is NULL or has room.
int32_t quarc_gap(quarc_decoder *decoder, quarc_gap_info *gap);

// The reject id of SPEC 3.3 after QUARC_REJECTED, else NULL. It lasts until `quarc_close`.
//
// `decoder` is NULL or open.
const char *quarc_reject_id(const quarc_decoder *decoder);

// What is wrong with the stream, for people; NULL where nothing is. It lasts until `quarc_close`.
//
// `decoder` is NULL or open.
const char *quarc_message(const quarc_decoder *decoder);

// A decoder of the frames from ordinal `start` on that reads a stream in parts, where it needs
// them. While `quarc_pull` says QUARC_OK, `quarc_missing` says which bytes it waits for;
// `quarc_put` hands them over. It keeps no more of them than it still needs.
quarc_decoder *quarc_open_parts(uint32_t start);

// Hand over `length` bytes that stand at `offset` of the stream; they are copied. QUARC_OK, or
// QUARC_MISUSE of a decoder that is not one of parts.
//
// `decoder` is NULL or open; `bytes` points to `length` bytes, or `length` is 0.
int32_t quarc_put(quarc_decoder *decoder, uint64_t offset, const uint8_t *bytes, size_t length);

// Say how many bytes the whole stream has, as soon as that is known; of one that is still being
// written it is not, and then TAIL ends it, whatever follows. QUARC_OK, or QUARC_MISUSE of a decoder that is not one of parts.
//
// `decoder` is NULL or open.
int32_t quarc_limit(quarc_decoder *decoder,
                    uint64_t size);

// Which bytes the last `quarc_pull` or `quarc_index` lacked: from `range[0]` up to `range[1]`.
// QUARC_OK, or QUARC_MISUSE where none are missing.
//
// `decoder` is NULL or open; `range` is NULL or has room for two numbers.
int32_t quarc_missing(quarc_decoder *decoder, uint64_t *range);

// Where the chunk after the last frame begins, in bytes. QUARC_OK, or QUARC_MISUSE before that is
// known, and of a decoder that is not one of parts.
//
// `decoder` is NULL or open; `offset` is NULL or has room.
int32_t quarc_offset(quarc_decoder *decoder, uint64_t *offset);

// What a canonical frame shows while the rest of its chunk is still missing: a picture while
// loading. After `quarc_pull` has said QUARC_OK. QUARC_FRAME: more of it has become known since the
// last call. `state` is filled; the sections of SPEC 8.5 that are known, from positions on, are
// `sections`, rotations are the identity before theirs, and other numbers 0. QUARC_OK: there is
// nothing new. No CRC proves it yet, and what is wrong with it is told by `quarc_pull`. Its
// pointers last until the next `quarc_preview`, `quarc_pull` or `quarc_close`.
//
// `decoder` is NULL or open; `state` and `sections` are NULL or have room.
int32_t quarc_preview(quarc_decoder *decoder, quarc_state *state, uint32_t *sections);

// What the end of a whole stream says of it: `numbers[0]` frames, `numbers[1]` of which are
// canonical. The ordinals of the first `room` of these go to `frames`. QUARC_OK: bytes are
// missing for that, or the stream has no INDX. QUARC_FRAME: it is done. Nothing is held against
// the frames yet, and what is wrong there is told when a frame is sought.
//
// `decoder` is NULL or open; `numbers` has room for two, `frames` for `room` numbers.
int32_t quarc_index(quarc_decoder *decoder, uint32_t *numbers, uint32_t *frames, size_t room);

// A camera of the stream, by its number from 0 on, once `came` has been pulled over: before the
// first frame, where the stream has it there. Its name lasts until the next `quarc_pull`.
// QUARC_OK, or QUARC_MISUSE where there is no such camera.
//
// `decoder` is NULL or open; `camera` is NULL or has room.
int32_t quarc_camera(quarc_decoder *decoder, size_t number, quarc_camera_info *camera);

// An entry of the stream's metadata, in the same way. Its texts last until the next `quarc_pull`.
//
// `decoder` is NULL or open; `entry` is NULL or has room.
int32_t quarc_metadata(quarc_decoder *decoder, size_t number, quarc_entry *entry);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* QUARC_H */
