/* Files of the computer that emulates us: ARM semihosting (IHI 0070).
 *
 * Source: the calls SYS_OPEN 0x01, SYS_CLOSE 0x02, SYS_WRITE 0x05, SYS_READ 0x06, SYS_GET_CMDLINE 0x15,
 * SYS_EXIT 0x18.  The words of the command line are QEMU's `-semihosting-config enable=on,arg=...,arg=...`.
 * What it does with bad input: a file that cannot be opened ends the emulation with an error.
 */
#ifndef FACTORLAB_SEMIHOSTING_H
#define FACTORLAB_SEMIHOSTING_H

#include <stddef.h>
#include <stdint.h>

enum semihost_mode { SEMIHOST_READ = 1 /* rb */, SEMIHOST_WRITE = 5 /* wb */ };

/* A file, by its place among the arguments (0 is the program's name); a missing argument gives -1. */
int32_t semihost_open(unsigned argument, enum semihost_mode mode);

/* Copies up to `size` characters of an argument; how many there were to copy, 0 for a missing argument. */
size_t semihost_argument(unsigned argument, char *into, size_t size);

/* Bytes read: less than asked for at the end of the file. */
size_t semihost_read(int32_t file, void *into, size_t size);

void semihost_write(int32_t file, const void *from, size_t size);
void semihost_close(int32_t file);

/* Ends the emulation; QEMU exits with 0, or with 1 after a failure. */
void semihost_exit(int failed) __attribute__((noreturn));

#endif /* FACTORLAB_SEMIHOSTING_H */
