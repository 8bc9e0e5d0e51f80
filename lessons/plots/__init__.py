"""Pictures for print and page. The only door to matplotlib; what is drawn is data (`panels`)."""
