#include "app.h"
#include "board.h"

int main(void)
{
    board_start();
    app_start();
    for (;;) {
        app_step(board_wait());
    }
}
