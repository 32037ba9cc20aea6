/* Decodes a stream and prints "frame gaussians sha256" for every frame.
 *
 *   cc player.c -I../include ../../target/release/libquarc_capi.a -lpthread -ldl -lm -o player
 *   ./player FILE
 *
 * Exit status: 0 success; 1 the stream is rejected; 2 any other error; 3 the stream exceeds the
 * limits of this decoder.
 */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "quarc.h"

/* Ends the program with a message about a file. */
static void fail(const char *name)
{
    fprintf(stderr, "player: %s: %s\n", name, strerror(errno));
    exit(2);
}

/* Prints the available frames; returns the result of the last quarc_pull. */
static int32_t show_frames(quarc_decoder *decoder)
{
    quarc_state state;
    char digest[QUARC_DIGEST_SIZE];
    int32_t status;

    while ((status = quarc_pull(decoder, &state)) == QUARC_FRAME) {
        quarc_digest(decoder, digest);
        if (printf("%" PRIu32 " %zu %s\n", state.frame, state.count, digest) < 0)
            fail("standard output");
    }
    return status;
}

/* Decodes a whole file; returns the result of the last quarc_pull. */
static int32_t decode(quarc_decoder *decoder, FILE *file, const char *name)
{
    static uint8_t bytes[1 << 16];
    int32_t status = QUARC_OK;
    size_t length;

    while (status >= 0 && (length = fread(bytes, 1, sizeof bytes, file)) > 0) {
        quarc_push(decoder, bytes, length);
        status = show_frames(decoder);
    }
    if (ferror(file))
        fail(name);
    if (status >= 0) {
        quarc_finish(decoder);
        status = show_frames(decoder);
    }
    return status;
}

int main(int argc, char **argv)
{
    quarc_decoder *decoder;
    int32_t status;
    FILE *file;

    if (argc != 2) {
        fprintf(stderr, "usage: player FILE\n");
        return 2;
    }
    if ((file = fopen(argv[1], "rb")) == NULL)
        fail(argv[1]);
    decoder = quarc_open();
    status = decode(decoder, file, argv[1]);
    if (status < 0) /* the message begins with the reject id, if there is one */
        fprintf(stderr, "player: %s: %s\n", argv[1], quarc_message(decoder));
    quarc_close(&decoder);
    fclose(file);
    if (fflush(stdout) != 0)
        fail("standard output");
    if (status >= 0)
        return 0;
    return status == QUARC_REJECTED ? 1 : status == QUARC_LIMIT ? 3 : 2;
}
