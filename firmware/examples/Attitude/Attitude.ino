/* Roll, pitch and yaw of an MPU-6050, 100 times a second, as lines
 *
 *     $ATT,sequence,t_ms,roll,pitch,yaw*hh        (degrees; hh: checksum as in NMEA 0183)
 *
 * Wiring (Uno, Nano): VCC 5V, GND GND, SDA A4, SCL A5; AD0 open or GND.
 * To see it: a terminal at 500 000 baud, or `factorlab record serial /dev/ttyACM0 -o attitude.csv`.
 * Calibrated: `factorlab calibrate imu ... --c-header calibration.h`, put that file beside this one, and
 * include "calibration.h" instead of the default below.
 */
#include <Wire.h>
#include <factorlab.h>
#include <factorlab_calibration_default.h>

const uint8_t MPU6050 = 0x68;
const uint32_t PERIOD_US = 10000;

mahony_q_state filter;
uint16_t sequence = 0;
uint32_t due;        // us, when the next sample is
uint8_t periods = 0; // since the last sample; 0: none yet

// Writes one register; false where the sensor does not answer.
bool set(uint8_t reg, uint8_t value)
{
    Wire.beginTransmission(MPU6050);
    Wire.write(reg);
    Wire.write(value);
    return Wire.endTransmission() == 0;
}

bool configure()
{
    return set(0x6B, 0x01)     // awake, clock of the gyro
           && set(0x1A, 0x03)  // low-pass 42 Hz, sampled at 1 kHz
           && set(0x1B, 0x18)  // +-2000 deg/s
           && set(0x1C, 0x10); // +-8 g
}

int16_t next()
{
    const uint8_t high = Wire.read();
    return (int16_t)((uint16_t)high << 8 | (uint8_t)Wire.read());
}

// One sample in SI; false where the sensor does not answer.
bool read(imu_q *sample)
{
    imu_raw raw = {};
    Wire.beginTransmission(MPU6050);
    Wire.write(0x3B);
    if (Wire.endTransmission(false) != 0 || Wire.requestFrom(MPU6050, (uint8_t)14) != 14) {
        return false;
    }
    for (uint8_t k = 0; k < 3; k++) {
        raw.accel[k] = next();
    }
    next(); // temperature
    for (uint8_t k = 0; k < 3; k++) {
        raw.gyro[k] = next();
    }
    calibrate_q(&gyro_calibration_q, &accel_calibration_q, NULL, &raw, sample);
    return true;
}

void setup()
{
    Serial.begin(500000);
    Wire.begin();
    Wire.setClock(400000);
#ifdef WIRE_HAS_TIMEOUT
    Wire.setWireTimeout(3000, true); // us; a bus that hangs is reset
#endif
    while (!configure()) {
        Serial.println(F("# no MPU-6050 at 0x68"));
        delay(500);
    }
    delay(40); // the gyro starts
    due = micros();
}

void loop()
{
    if ((int32_t)(micros() - due) < 0) {
        return;
    }
    const uint32_t now = due;
    due += PERIOD_US;

    imu_q sample;
    if (!read(&sample)) {
        periods = periods == 0 || periods == 255 ? periods : periods + 1;
        configure(); // it may have lost its power
        return;
    }
    if (periods == 0) {
        mahony_q_start(&filter, &mahony_q_100hz, &sample);
    }
    mahony_q_step(&filter, &mahony_q_100hz, &sample, periods);
    periods = 1;

    int32_t world_q_body[4];
    int16_t angles[3];
    uint8_t line[TEXT_LARGEST];
    mahony_q_attitude(&filter, world_q_body);
    angles_q(world_q_body, angles);
    Serial.write(line, text_attitude(line, sequence++, now, angles));
}
