/* The most stack that was used: its end is painted first, and looked at last. */
#ifndef FACTORLAB_STACK_H
#define FACTORLAB_STACK_H

#include <stdint.h>

#define STACK_WATCHED 8192U /* bytes: mps2.ld says where they begin */

void stack_paint(void);

uint32_t stack_used(void); /* bytes, STACK_WATCHED at most */

#endif /* FACTORLAB_STACK_H */
