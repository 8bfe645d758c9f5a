/* From reset to main on a Cortex-M4F: what is the same on every board.
 *
 * A board file gives the vector table (section .vectors: initial stack, these handlers, its own interrupts);
 * a linker script names the edges of .data, .bss and the stack.
 */
#ifndef FACTORLAB_STARTUP_H
#define FACTORLAB_STARTUP_H

typedef void (*handler)(void);

extern unsigned char stack_top[]; /* of the linker script */

void reset_handler(void);   /* enables the FPU, fills .data, clears .bss, calls main */
void default_handler(void); /* of an interrupt or a fault that nobody expects */

#endif /* FACTORLAB_STARTUP_H */
