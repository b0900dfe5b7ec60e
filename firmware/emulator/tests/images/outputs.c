/* PWM on PD7 while the program's own PORTD7 is low; an EEPROM byte; an interrupt enabled after its
   flag. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>

#define LOG ((volatile uint8_t *)0x3F00)
#define TIME (*(volatile uint16_t *)0x3F10)

ISR(TIMER1_COMPB_vect) { LOG[0]++; }

int main(void) {
    LOG[0] = LOG[1] = LOG[2] = 0;
    DDRD = _BV(PD7);
    OCR2A = 100;
    TCCR2A = _BV(COM2A1) | _BV(WGM21) | _BV(WGM20);
    TCCR2B = _BV(CS20);
    TCCR1B = _BV(CS11) | _BV(CS10); /* clk/64: 4 us */
    for (uint16_t i = 0; i < 5000; i++) LOG[1] |= PORTD & _BV(PD7);
    EEDR = 0x5A;
    EEAR = 7;
    EECR = _BV(EEMPE);
    EECR = _BV(EEMPE) | _BV(EEPE);
    uint16_t start = TCNT1;
    while (EECR & _BV(EEPE)) {}
    TIME = TCNT1 - start;
    OCR1B = TCNT1 + 10;
    TIFR1 = _BV(OCF1B);
    sei();
    while (!(TIFR1 & _BV(OCF1B))) {}
    TIMSK1 = _BV(OCIE1B);
    LOG[2] = 1;
    for (;;) {}
}
