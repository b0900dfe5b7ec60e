/* Sleeps and counts rises on PB2 = INT2. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#define LOG ((volatile uint8_t *)0x3F00)

ISR(INT2_vect) { LOG[0]++; }

int main(void) {
    LOG[0] = 0;
    EICRA = _BV(ISC21) | _BV(ISC20);
    EIMSK = _BV(INT2);
    sei();
    for (;;) sleep_mode();
}
