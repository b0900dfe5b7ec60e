/* Notes why it started, then lets the watchdog bite: with its interrupt and I clear. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#define LOG ((volatile uint8_t *)0x3F00)

int main(void) {
    uint8_t cause = MCUSR;
    MCUSR = 0;
    if (cause & _BV(PORF)) LOG[0] = 0;
    LOG[1 + LOG[0]] = cause;
    LOG[0]++;
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDIE) | _BV(WDE); /* 16 ms */
    for (;;) {}
}
