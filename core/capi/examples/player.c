/* Decodes a stream and prints "frame gaussians sha256" for every frame.
 *
 *   cc player.c -I../include ../../target/release/libquarc_capi.a -lpthread -ldl -lm -o player
 *   ./player FILE
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "quarc.h"

/* Prints the available frames; returns the result of the last quarc_pull. */
static int32_t show_frames(quarc_decoder *decoder)
{
    quarc_state state;
    char digest[QUARC_DIGEST_SIZE];
    int32_t status;

    while ((status = quarc_pull(decoder, &state)) == QUARC_FRAME) {
        quarc_digest(decoder, digest);
        printf("%" PRIu32 " %zu %s\n", state.frame, state.count, digest);
    }
    return status;
}

int main(int argc, char **argv)
{
    static uint8_t bytes[1 << 16];
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    quarc_decoder *decoder;
    int32_t status = QUARC_OK;
    size_t length;

    if (file == NULL) {
        fprintf(stderr, "usage: player FILE\n");
        return 2;
    }
    decoder = quarc_open();
    while (status >= 0 && (length = fread(bytes, 1, sizeof bytes, file)) > 0) {
        quarc_push(decoder, bytes, length);
        status = show_frames(decoder);
    }
    if (status >= 0) {
        quarc_finish(decoder);
        status = show_frames(decoder);
    }
    if (status < 0) {
        const char *id = quarc_reject_id(decoder);
        fprintf(stderr, "%s (%s)\n", quarc_message(decoder), id != NULL ? id : "no reject id");
    }
    quarc_close(&decoder);
    fclose(file);
    return status < 0;
}
