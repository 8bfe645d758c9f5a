/* Feeds an image (cycles_avr.c) in libsimavr with samples of a file and counts the cycles of every update.
 *
 *     cycles_avr_simulator IMAGE.elf SAMPLES.bin ANSWERS.bin
 *
 * A sample: gyro i32 x 3, accelerometer i16 x 3, field i16 x 3, periods u8, 3 bytes of 0 (28 bytes).  An
 * answer: cycles u32, stack u32 (bytes from the call on, return address and all), then the state as the
 * image holds it. Last line on stdout: "updates <n> mean <cycles> worst <cycles> least <cycles> stack
 * <bytes>".
 */
#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SAMPLE 24
#define ROW 28
#define PAINT 0xA5
#define GPIOR1_AT 0x4A
#define SP_AT 0x5D

static struct {
    avr_t *avr;
    FILE *in, *out;
    unsigned state_size;
    avr_cycle_count_t risen;
    unsigned stack_at, bottom;
    unsigned long updates, worst, least, deepest;
    double total;
    int done;
} run;

static unsigned word_at(unsigned place)
{
    return (unsigned)(run.avr->data[place] | run.avr->data[place + 1] << 8);
}

static void asked(struct avr_irq_t *irq, uint32_t value, void *param)
{
    unsigned char row[ROW];
    (void)irq;
    (void)param;
    if (!(value & 1)) {
        return;
    }
    if (fread(row, ROW, 1, run.in) != 1) {
        run.done = 1;
        return;
    }
    unsigned box = word_at(GPIOR1_AT);
    run.avr->data[box] = row[SAMPLE];
    memcpy(run.avr->data + box + 1, row, SAMPLE);
}

static void worked(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    if (value & 1) {
        run.risen = run.avr->cycle;
        run.stack_at = word_at(SP_AT);
        run.bottom = run.stack_at > 400 ? run.stack_at - 400 : 0x100;
        memset(run.avr->data + run.bottom, PAINT, run.stack_at - run.bottom + 1);
        return;
    }
    if (run.risen == 0) { /* the port was set up */
        return;
    }
    unsigned long cycles = (unsigned long)(run.avr->cycle - run.risen);
    unsigned low = run.bottom;
    while (low <= run.stack_at && run.avr->data[low] == PAINT) {
        low++;
    }
    uint32_t answer[2] = {(uint32_t)cycles, run.stack_at - low + 1};
    fwrite(answer, sizeof answer, 1, run.out);
    fwrite(run.avr->data + word_at(GPIOR1_AT) + 1 + SAMPLE, run.state_size, 1, run.out);
    if (run.updates > 0) { /* the first only starts */
        run.total += (double)cycles;
        run.worst = cycles > run.worst ? cycles : run.worst;
        run.least = run.least == 0 || cycles < run.least ? cycles : run.least;
    }
    run.deepest = answer[1] > run.deepest ? answer[1] : run.deepest;
    run.updates++;
}

int main(int argc, char **argv)
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (argc != 5 || elf_read_firmware(argv[1], &firmware) != 0) {
        fprintf(stderr, "usage: %s IMAGE.elf SAMPLES.bin ANSWERS.bin STATE_BYTES\n", argv[0]);
        return 2;
    }
    run.in = fopen(argv[2], "rb");
    run.out = fopen(argv[3], "wb");
    run.state_size = (unsigned)atoi(argv[4]);
    run.avr = avr_make_mcu_by_name("atmega328p");
    if (run.in == NULL || run.out == NULL || run.avr == NULL) {
        fprintf(stderr, "%s: cannot open %s or %s, or there is no atmega328p\n", argv[0], argv[2], argv[3]);
        return 1;
    }
    avr_init(run.avr);
    run.avr->frequency = 16000000;
    avr_load_firmware(run.avr, &firmware);
    avr_irq_register_notify(avr_io_getirq(run.avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_PIN0), asked,
                            NULL);
    avr_irq_register_notify(avr_io_getirq(run.avr, AVR_IOCTL_IOPORT_GETIRQ('B'), IOPORT_IRQ_PIN0), worked,
                            NULL);
    while (!run.done) {
        int state = avr_run(run.avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "the image ended after %lu updates\n", run.updates);
            return 1;
        }
    }
    fclose(run.out);
    printf("updates %lu mean %.1f worst %lu least %lu stack %lu\n", run.updates,
           run.total / (double)(run.updates > 1 ? run.updates - 1 : 1), run.worst, run.least, run.deepest);
    return 0;
}
