/* Cycles of a first and of a second conversion at clk/16, and the second's ten bits. */
#include <avr/io.h>

#define LOG ((volatile uint16_t *)0x3F00)

static uint16_t convert(void) {
    uint16_t start = TCNT1;
    ADCSRA |= _BV(ADSC);
    while (ADCSRA & _BV(ADSC)) {}
    return TCNT1 - start;
}

int main(void) {
    TCCR1B = _BV(CS10);
    ADMUX = _BV(REFS0) | 1;
    ADCSRA = _BV(ADEN) | _BV(ADPS2);
    LOG[0] = convert();
    LOG[1] = convert();
    LOG[2] = ADC;
    LOG[3] = 1;
    for (;;) {}
}
