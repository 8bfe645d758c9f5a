#include "app.h"

#include "../core/frame.h"
#include "../core/text.h"
#include "../core/trig_q.h"
#include "board.h"
#include "filter.h"
#include "mpu6050.h"

#ifndef APP_MODE
#define APP_MODE COMMAND_QUATERNION /* what is sent until a command says otherwise */
#endif

#define VERSION {0, 1, 0} /* of the firmware: major, minor, patch */

struct app {
    struct mpu6050 sensor;
    uint16_t sequence; /* number of the next frame */
    uint8_t mode;      /* COMMAND_QUATERNION, COMMAND_ANGLES, COMMAND_RAW, COMMAND_TEXT */
    uint8_t due;       /* 1: this period has not had its frame yet */
    uint8_t prepared;  /* 1: the filter has the accelerometer of this period */
    uint8_t periods;   /* since the last sample, at most 255 */
    uint8_t overrun;   /* FRAME_OVERRUN: a frame was dropped, which no status has said yet */
};

static struct app app;

/* Room for a whole frame, or the note that there was none. */
static uint8_t has_room(uint8_t bytes)
{
    if (board_room() >= bytes) {
        return 1;
    }
    app.overrun = FRAME_OVERRUN;
    app.sequence++;
    return 0;
}

/* Starts with the one byte that is known before anything is encoded. */
static void send_first(uint8_t byte)
{
    (void)board_write(&byte, 1);
}

static void send_rest(const uint8_t *frame, uint8_t length)
{
    (void)board_write(frame + 1, (uint8_t)(length - 1U));
    app.sequence++;
}

static void send_quaternion(uint8_t status)
{
    uint8_t frame[FRAME_LARGEST];
    int32_t world_q_body[4], bias[3];
    send_first(FRAME_START);
    filter_attitude(world_q_body);
    filter_bias(bias);
    send_rest(frame, frame_quaternion(frame, app.sequence, board_time_us(), world_q_body, bias, status));
}

static void angles_now(int16_t roll_pitch_yaw[3])
{
    int32_t world_q_body[4];
    filter_attitude(world_q_body);
    angles_q(world_q_body, roll_pitch_yaw);
}

static void send_angles(uint8_t status)
{
    uint8_t frame[FRAME_LARGEST];
    int16_t angles[3];
    int32_t bias[3];
    angles_now(angles);
    send_first(FRAME_START);
    filter_bias(bias);
    send_rest(frame, frame_angles(frame, app.sequence, board_time_us(), angles, bias, status));
}

static void send_text(void)
{
    uint8_t line[TEXT_LARGEST];
    int16_t angles[3];
    angles_now(angles);
    send_first('$');
    send_rest(line, text_attitude(line, app.sequence, board_time_us(), angles));
}

static void send_raw(uint8_t status)
{
    uint8_t frame[FRAME_LARGEST];
    send_first(FRAME_START);
    send_rest(frame, frame_raw(frame, app.sequence, board_time_us(), app.sensor.counts, status));
}

/* The one frame of this period. */
static void report(uint8_t status)
{
    app.due = 0;
    if (has_room(app.mode == COMMAND_TEXT ? TEXT_LARGEST : FRAME_LARGEST) == 0U) {
        return;
    }
    if (app.mode != COMMAND_TEXT) { /* a line has no status to say it in */
        status = (uint8_t)(status | app.overrun);
        app.overrun = 0;
    }
    switch (app.mode) {
    case COMMAND_ANGLES:
        send_angles(status);
        break;
    case COMMAND_TEXT:
        send_text();
        break;
    case COMMAND_RAW:
        send_raw(status);
        break;
    default:
        send_quaternion(status);
        break;
    }
}

static void send_boot(void)
{
    static const struct boot_facts fixed = {
        VERSION, 0, 0, BOOT_MPU6050, BOARD_RATE_HZ, 0, MPU6050_GYRO_RANGE_DEG_S, MPU6050_ACCEL_RANGE_G};
    uint8_t frame[FRAME_LARGEST];
    struct boot_facts facts = fixed;
    facts.target = board_target;
    facts.filter = filter_kind;
    facts.calibration_hash = filter_calibration_hash;
    if (has_room(FRAME_LARGEST) != 0U) {
        send_first(FRAME_START);
        send_rest(frame, frame_boot(frame, app.sequence, board_time_us(), &facts));
    }
}

static void choose(uint8_t mode)
{
    app.mode = mode;
    board_phase(mode == COMMAND_ANGLES || mode == COMMAND_TEXT ? BOARD_AFTER_ANGLES : BOARD_AFTER_UPDATE);
}

static void obey(uint8_t command)
{
    switch (command) {
    case COMMAND_QUATERNION:
    case COMMAND_ANGLES:
    case COMMAND_RAW:
    case COMMAND_TEXT:
        choose(command);
        break;
    case COMMAND_BOOT:
        send_boot();
        break;
    default:
        break;
    }
}

/* The sensor's word on this period. */
static void take(uint8_t answer)
{
    if (answer == MPU6050_PENDING) {
        return;
    }
    if (answer == MPU6050_NOTHING) {
        if (app.due != 0U) {
            report((uint8_t)(filter_status() | FRAME_SAMPLE_MISSING));
        }
        return;
    }
    if (app.prepared == 0U) {
        filter_accel(app.sensor.counts);
    }
    board_mark_update(1);
    filter_update(app.sensor.counts + MPU6050_GYRO, app.periods);
    board_mark_update(0);
    app.periods = 0;
    report((uint8_t)(filter_status() | (answer == MPU6050_SATURATED ? FRAME_SATURATED : 0U)));
}

static void tick(void)
{
    uint8_t periods;
    if (app.due != 0U) { /* the transfer of the last period never ended: its frame, with its time */
        report((uint8_t)(filter_status() | FRAME_SAMPLE_MISSING));
    }
    periods = board_periods();
    app.sequence = (uint16_t)(app.sequence + periods - 1U);
    app.periods = (uint8_t)(periods > UINT8_MAX - app.periods ? UINT8_MAX : app.periods + periods);
    app.due = 1;
    app.prepared = 0;
    take(mpu6050_tick(&app.sensor));
}

void app_start(void)
{
    choose(APP_MODE);
    filter_start();
    mpu6050_start(&app.sensor);
    send_boot();
}

void app_step(uint8_t events)
{
    if ((events & BOARD_I2C_PART) != 0U && mpu6050_part(&app.sensor) != 0U) {
        filter_accel(app.sensor.counts);
        app.prepared = 1;
    }
    if ((events & BOARD_I2C) != 0U) { /* before a tick: it belongs to the period before */
        take(mpu6050_transferred(&app.sensor));
    }
    if ((events & BOARD_TICK) != 0U) {
        tick();
    }
    if ((events & BOARD_RECEIVED) != 0U) {
        int16_t byte;
        while ((byte = board_received()) >= 0) {
            obey((uint8_t)byte);
        }
    }
}
