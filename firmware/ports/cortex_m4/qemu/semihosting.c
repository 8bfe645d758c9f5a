#include "semihosting.h"

#define SYS_OPEN 0x01
#define SYS_CLOSE 0x02
#define SYS_WRITE 0x05
#define SYS_READ 0x06
#define SYS_GET_CMDLINE 0x15
#define SYS_EXIT 0x18
#define APPLICATION_EXIT 0x20026UL
#define RUN_TIME_ERROR 0x20023UL
#define COMMAND_LINE_MAX 1024 /* bytes */

static int32_t call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm("r0") = operation;
    register const void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}

/* Start and length of a word of the command line; length 0 where there is none. */
static size_t word(const char *line, unsigned index, const char **start)
{
    while (*line == ' ') {
        line++;
    }
    for (; index > 0 && *line != '\0'; index--) {
        while (*line != ' ' && *line != '\0') {
            line++;
        }
        while (*line == ' ') {
            line++;
        }
    }
    *start = line;
    while (*line != ' ' && *line != '\0') {
        line++;
    }
    return (size_t)(line - *start);
}

/* The command line in memory of ours; the word ends with a zero. */
static size_t argument_word(unsigned argument, const char **start)
{
    static char line[COMMAND_LINE_MAX];
    const struct {
        char *buffer;
        uint32_t size; /* bytes */
    } into = {line, sizeof line};
    if (call(SYS_GET_CMDLINE, &into) != 0) {
        return 0;
    }
    const size_t length = word(line, argument, start);
    line[(size_t)(*start - line) + length] = '\0';
    return length;
}

size_t semihost_argument(unsigned argument, char *into, size_t size)
{
    const char *start;
    size_t length = argument_word(argument, &start);
    length = length < size ? length : size;
    for (size_t k = 0; k < length; k++) {
        into[k] = start[k];
    }
    return length;
}

int32_t semihost_open(unsigned argument, enum semihost_mode mode)
{
    const char *name;
    const size_t length = argument_word(argument, &name);
    const struct {
        const char *name;
        uint32_t mode;
        uint32_t length; /* bytes */
    } open = {name, (uint32_t)mode, (uint32_t)length};
    if (length == 0) {
        return -1;
    }
    const int32_t file = call(SYS_OPEN, &open);
    if (file < 0) {
        semihost_exit(1);
    }
    return file;
}

size_t semihost_read(int32_t file, void *into, size_t size)
{
    const struct {
        int32_t file;
        void *into;
        uint32_t size;
    } read = {file, into, (uint32_t)size};
    const int32_t missing = call(SYS_READ, &read);
    return missing < 0 ? 0 : size - (size_t)missing;
}

void semihost_write(int32_t file, const void *from, size_t size)
{
    const struct {
        int32_t file;
        const void *from;
        uint32_t size;
    } written = {file, from, (uint32_t)size};
    if (call(SYS_WRITE, &written) != 0) {
        semihost_exit(1);
    }
}

void semihost_close(int32_t file)
{
    const int32_t closed[1] = {file};
    (void)call(SYS_CLOSE, closed);
}

/* On a 32-bit machine the reason is the argument itself, not a pointer to it. */
void semihost_exit(int failed)
{
    (void)call(SYS_EXIT, (const void *)(failed != 0 ? RUN_TIME_ERROR : APPLICATION_EXIT));
    for (;;) {
    }
}
