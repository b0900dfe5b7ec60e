/* Ten pulses of 10 us on PD4, 100 us apart, starting 5 ms after power. */
#include <avr/io.h>
#include <util/delay.h>

int main(void) {
    DDRD = _BV(PD4);
    _delay_ms(5);
    for (uint8_t i = 0; i < 10; i++) {
        PORTD |= _BV(PD4);
        _delay_us(10);
        PORTD &= ~_BV(PD4);
        _delay_us(90);
    }
    for (;;) {}
}
